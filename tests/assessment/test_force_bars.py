"""Bars of forces on bones: closed form, the length of vectors, values that are unknown, and a finer solution."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small
from numpy.testing import assert_allclose

from fem_reference.assessment.error_bars import SPREAD, ErrorBar, Pair
from fem_reference.assessment.force_bars import force_bars
from fem_reference.metrics import MeasurementContext
from fem_reference.runs.contents import vector_scalars
from fem_reference.runs.store import Run
from fem_reference.studies import workflow
from tests.assessment.test_error_bars import FIBRE, TIMES, run

POINT = np.array([7.0, 10.0, 0.0])


def pulled(force: tuple[float, float, float], growth: float = 0.1) -> Run:
    """A sphere between two bones; the ``force`` [N] at time 1 at ``POINT`` on the femur, and its opposite on the pelvis."""
    on = {name: sign * np.outer(TIMES, force) for name, sign in (("femur", 1.0), ("pelvis", -1.0))}
    scalars = dict[str, np.ndarray]()
    for bone, forces in on.items():
        for kind, vectors in (("force", forces), ("moment", np.cross(POINT, forces))):
            scalars |= dict(zip(vector_scalars(f"{kind}_on_{bone}", np.zeros(3)), vectors.T, strict=True))
    return replace(run(growth), scalars=scalars)


def bars(fine: Run, coarse: Run, **more) -> dict[tuple[str, str], ErrorBar]:
    """By metric and bone, of sizes h and 2 h."""
    pair = Pair(fine, coarse, (4.0, 8.0), more.pop("varied", {}), **more)
    found = force_bars(pair, MeasurementContext.of(fine, FIBRE, ()))
    assert all(bar.of == "change" for bar in found)
    return {(bar.metric, bar.statistic): bar for bar in found}


def test_bars_cover_an_error_of_first_order_with_the_safety_of_a_lone_value() -> None:
    """Forces 0.2 N apart at time 1 on sizes h and 2 h: 1.5 times that for a force; 1.25 / (2^1.5 - 1) for a moment, 12 mm off."""
    found = bars(pulled((0.0, 3.0, 4.0)), pulled((0.0, 3.0, 4.2), growth=0.11))
    for bone in ("femur", "pelvis"):
        force, moment = found["force_on_bone", bone], found["moment_on_bone", bone]
        assert_allclose(force.values, 1.5 * 0.2 * TIMES, atol=1e-9)
        assert_allclose(moment.values, 1.25 / (2**1.5 - 1) * 0.2 * np.hypot(7, 10) * TIMES, atol=1e-9)
        assert (force.unit, moment.unit, force.model) == ("N", "N mm", None)
        assert force.parts == {"tetrahedra": pytest.approx(0.6)}


def test_a_force_that_only_turns_is_not_known_exactly() -> None:
    """3, 4 beside 4, 3: of one length, and 1.41 N apart."""
    found = bars(pulled((0.0, 3.0, 4.0)), pulled((0.0, 4.0, 3.0), growth=0.11))
    assert_allclose(found["force_on_bone", "femur"].values, 1.5 * np.sqrt(2) * TIMES, atol=1e-9)


def test_causes_are_added_as_squares_and_the_model_stays_beside() -> None:
    """Contact changes 0.05 N where halved, twice that is all; other springs at least 9 % of 5 N, exact attachments 1 N."""
    fine, coarse = pulled((0.0, 3.0, 4.0)), pulled((0.0, 3.0, 4.2), growth=0.11)
    varied = {"contact stiffness": pulled((0.0, 3.05, 4.2), growth=0.111)}
    bar = bars(fine, coarse, varied=varied, springs=True)["force_on_bone", "femur"]
    assert_allclose(bar.values, np.hypot(0.3, 0.1) * TIMES, atol=1e-9)
    assert_allclose(bar.model, SPREAD * 5 * TIMES)
    exact = pulled((1.0, 3.0, 4.2), growth=0.12)
    assert_allclose(bars(fine, coarse, springs=True, exact=exact)["force_on_bone", "femur"].model, TIMES)
    # Exact attachments of its neighbour reach a muscle without springs too.
    assert_allclose(bars(fine, coarse, exact=exact)["force_on_bone", "femur"].model, TIMES)


def test_what_nobody_knows_has_no_bar() -> None:
    """A run without forces; a frame that the coarser run did not reach."""
    fine, coarse = pulled((0.0, 3.0, 4.0)), pulled((0.0, 3.0, 4.2), growth=0.11)
    assert bars(run(0.1), run(0.11)) == {}
    lost = {name: np.where(TIMES < 2, values, np.nan) for name, values in coarse.scalars.items()}
    positions = np.where(TIMES[:, None, None] < 2, coarse.positions, np.nan)
    bar = bars(fine, replace(coarse, scalars=lost, positions=positions))["force_on_bone", "femur"]
    assert_allclose(bar.values, [0, 0.3, np.nan], atol=1e-9)


@pytest.mark.slow
def test_the_bars_of_a_bent_bar_cover_the_difference_from_a_finer_solution(tmp_path: Path) -> None:
    """Tetrahedra of 8 mm beside those of 5 mm. The floor, which has no joint, is pulled as the lid is, and has the same bars."""
    changes = {"frames.last": 10, "candidate": []}
    runs = {}
    for size in (5, 8):
        case = workflow.load_case(small.write(tmp_path / "bar"), changes | {"muscle.tet_size": f"{size} mm"})
        runs[size] = workflow.solve(case, store=tmp_path / "store")
    known = workflow.error_bars(case, runs[8], store=tmp_path / "store")
    assert known is not None
    for kind in ("force", "moment"):
        floor, lid = (known.find("change", f"{kind}_on_bone", bone) for bone in ("floor", "lid"))
        assert floor is not None
        assert lid is not None
        assert_allclose(floor.values, lid.values, rtol=1e-3)
        off = getattr(runs[8], kind)("floor") - getattr(runs[5], kind)("floor")
        assert (np.linalg.norm(off, axis=1) <= floor.values).all()
