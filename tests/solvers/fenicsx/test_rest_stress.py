"""The stress at rest of bodies in situ: closed forms of a bar between plates."""

from dataclasses import replace

import numpy as np
import pytest
from tense import (
    ACTIVE,
    PENALTY,
    SIZE,
    in_situ,
    muscle,
    plated,
    solved,
    tension,
)

from fem_reference.foundations.mesh import TetMesh
from fem_reference.problems.paths import Affine
from fem_reference.runs.results import Results

pytestmark = pytest.mark.slow


def test_without_a_stretch_nothing_changes(session) -> None:
    pull = Affine(((0.0,) * 3, (0.0,) * 3, (0.0, 0.0, 0.1)))
    one, other = (solved(session, muscle(*more, top=pull)) for more in ((), (in_situ(1.0),)))
    assert other.last.points == pytest.approx(one.last.points, abs=1e-12 * SIZE[2])
    assert other.last.forces["top"] == pytest.approx(one.last.forces["top"], rel=1e-10)


@pytest.mark.parametrize("tone", [0.0, 0.05])
def test_the_force_at_rest_is_that_of_the_laws_at_the_stretch(session, tone) -> None:
    """``A l dW/dl`` of the given section A, with W of the whole stretch l; the stress at rest is a pressure alone, up to mu / K =
    1e-5 of the tension.
    """
    stretch, area = 1.1, SIZE[0] * SIZE[1]
    acting = (ACTIVE,) if tone else ()
    found = solved(session, plated(stretch, 0.0, *acting)).last.forces["plate"][2]
    assert found == pytest.approx(area * tension(stretch, tone), rel=1e-4)


def test_fibres_are_slack_where_the_plates_approach_by_the_stretch(session) -> None:
    """``F Fp = 1`` there; the pressure at rest, p0, has changed the volume by p0 / K = 1e-5, which leaves 3 mu A 1e-5 / 3 =
    1e-5 N. Halfway there, a force remains.
    """
    stretch = 1.1
    assert solved(session, plated(stretch, 1 - 1 / stretch)).last.forces["plate"][2] == pytest.approx(0, abs=3e-5)
    assert solved(session, plated(stretch, 0.5 - 0.5 / stretch)).last.forces["plate"][2] > 0.3


@pytest.mark.parametrize("element", ["P2/P1", "P2"])
def test_the_stress_at_rest_is_in_the_results(session, element) -> None:
    """Of straight fibres between plates it is the tension of the laws alone, at any point, and none across."""
    body = plated(1.1, 0.0)
    acting = body.effects if element == "P2/P1" else (*body.effects[:1], PENALTY, *body.effects[2:])
    body = replace(body, effects=acting)
    run = solved(session, body, element, store_state=True)
    cells = TetMesh(body.mesh.points, body.mesh.cells)
    fibre = np.tile([0.0, 0.0, 1.0], (len(cells.tets), 1))
    results = Results(cells, acting, {1.0: run.last.state}, fibre)
    stress = results.evaluate(np.array([[3.0, 4.0, 15.0], [7.0, 2.0, 33.0]]), 1.0)["cauchy_stress"]
    tension = run.last.forces["plate"][2] / (SIZE[0] * SIZE[1])
    wanted = np.zeros((2, 3, 3))
    wanted[:, 2, 2] = tension
    assert stress == pytest.approx(wanted, abs=1e-9)
    energy = sum(results.energies(1.0).values())
    assert energy == pytest.approx(run.last.scalars["energy"], rel=1e-9)
