"""The tasks that the second opinion offers."""

from fem_reference import solvers


def test_it_is_a_solver_of_bodies() -> None:
    assert "scikit_fem" in solvers.names("solve_body")
