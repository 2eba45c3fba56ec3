"""Sharper problems that the error bars of bodies are made of."""

from dataclasses import replace

import numpy as np

import fem_reference as fr
from fem_reference.assessment import second_check
from fem_reference.assessment.run_checks import RunCheck
from fem_reference.solvers import fenicsx
from fem_reference.studies import body_refinement
from tests.assessment.test_body_bars import square_bar


def test_load_steps_are_halved_where_time_matters() -> None:
    body = square_bar("Q2/Q1", 1)
    settings = fenicsx.BodySettings(element="Q2/Q1", first_step=0.5, store_state=True)
    assert body_refinement.sharper_problem(body, settings)[2] == {"store_state": False}
    timed = replace(body, effects=(*body.effects, fr.make_effect("viscosity", eta=1.0)), interval=1.0)
    *_, changes, said = body_refinement.sharper_problem(timed, settings)
    assert changes == {"store_state": False, "first_step": 0.25, "largest_step": 0.5}
    assert said == "Q2/Q1 on cells of half the size and load steps of half the length"
    coarse = settings.model_copy(update={"element": "P1/P1", "quadrature_degree": 2})
    assert body_refinement.sharper_problem(timed, coarse)[2] | changes == {
        **changes,
        "element": "P2/P1",
        "quadrature_degree": None,
    }


def test_without_a_quadratic_element_cells_are_halved() -> None:
    body, settings = square_bar("P1", 1), fenicsx.BodySettings(element="P1")
    same, shared, changes, said = body_refinement.sharper_problem(body, settings)
    assert (same, changes["element"], said) == (body, "P2", "P2 on the same cells")
    assert np.array_equal(shared, np.arange(len(body.mesh.points)))
    finer, shared, changes, said = body_refinement.sharper_problem(
        square_bar("P2/P1", 1), fenicsx.BodySettings(element="P2/P1")
    )
    assert len(finer.mesh.cells) == 8 * len(square_bar("P2/P1", 1).mesh.cells)
    assert np.allclose(finer.mesh.points[shared], square_bar("P2/P1", 1).mesh.points)
    assert said == "P2/P1 on cells of half the size"


def test_a_sharper_solution_that_the_second_check_denies_gives_no_bar(monkeypatch) -> None:
    body = square_bar("P1/P1", 1)
    solved = fr.solve_body(body, element="P1/P1")
    assert np.isfinite(fr.error_bars(body, solved).displacement).all()
    monkeypatch.setattr(second_check, "of_body", lambda *_: (RunCheck("det F", 2.0, 1.0, "", 1.0),))
    assert np.isnan(fr.error_bars(body, solved).displacement).all()
