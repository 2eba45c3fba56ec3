"""The convergence that pages show of scalar cases: orders that theory has, and never a solution against itself."""

import pytest

from fem_reference.problems import of_case
from fem_reference.scenes import casefile
from fem_reference.studies.convergence import ladders


def test_orders_are_those_of_theory_on_the_two_finest_meshes() -> None:
    """In L2 p + 1 of elements of order p: 2.00 and 2.99 here; the coarsest of six meshes does not resolve the layer."""
    case = casefile.read("rod_advection")
    first, second = ladders(of_case.problem(case, of_case.setup(case)), case)
    assert (first.element, second.element) == ("P1", "P2")
    assert first.order == pytest.approx(2, abs=0.05)
    assert second.order == pytest.approx(3, abs=0.05)
    assert first.cells == tuple(20 * 2**level for level in range(6))


def test_without_an_exact_solution_the_finest_is_not_measured_against_itself() -> None:
    """The finest of order 2 is what the others are measured against, so that one mesh fewer has an error of that order."""
    case = casefile.read("rod_advection").model_copy(update={"exact": None})
    first, second = ladders(of_case.problem(case, of_case.setup(case)), case)
    assert (len(first.errors), len(second.errors)) == (6, 5)
    assert min(first.errors + second.errors) > 0
    assert "finest" in second.against
