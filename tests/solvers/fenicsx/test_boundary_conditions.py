"""Springs over facets and at points take the loads that closed forms give them."""

import numpy as np
import pytest
from scipy.optimize import brentq

from fem_reference.geometry import skins
from fem_reference.geometry.skins import Skin
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Affine, Rest, Turn
from tests.solvers.fenicsx.test_body import BOTH, FLESH, ONCE, box, effect, settings

pytestmark = pytest.mark.slow


@BOTH
def test_a_block_on_springs_moves_by_the_load_over_their_stiffness(element, session) -> None:
    stiffness, load = 0.05, 0.004  # [MPa/mm], [MPa]
    acting = (*FLESH, effect("traction", on="z1", force=f"0, 0, -{load} MPa", ramp=ONCE))
    springs = Prescribed("springs", "z0", (2,), Rest(), stiffness)
    fixed = (Prescribed("x0", "x0", (0,), Rest()), Prescribed("y0", "y0", (1,), Rest()), springs)
    mesh = box(element, size=(2.0, 1.0, 1.0))
    state = session.solve(Body(mesh, acting, fixed, (0.0, 1.0)), settings(element)).last
    # Homogeneous, so that every element has it; Newton's residual of 1e-12 N over 0.05 N/mm.
    assert state.points[mesh.points[:, 2] == 0, 2] == pytest.approx(-load / stiffness, abs=1e-10)
    assert state.forces["springs"] == pytest.approx([0, 0, load * 2.0], abs=1e-11)
    assert state.forces["x0"] == pytest.approx(np.zeros(3), abs=1e-11)


@pytest.mark.parametrize("element", ["P2/P1", "P2/P0"])
def test_springs_at_points_beside_the_cells_take_the_load_and_its_moment(element, session) -> None:
    # Points 0.05 mm below the face that springs attach, of uneven areas; the pull is off their middle: the block turns on them.
    stiffness, load = 1e-4, 1e-7  # so soft that the block is rigid, and turns by a thousandth
    acting = (*FLESH, effect("traction", on="x1", force=f"0, 0, -{load} MPa", ramp=ONCE))
    mesh = box(element, (2, 2, 2), (1.0, 1.0, 1.0))
    at = np.array([[0.2, 0.3, -0.05], [0.7, 0.2, -0.05], [0.3, 0.8, -0.05], [0.9, 0.9, -0.05]])
    middles = mesh.points[mesh.cells].mean(axis=1)
    cells = np.array([np.argmin(np.linalg.norm(middles - point, axis=1)) for point in at])
    skin = Skin(cells, at, np.array([0.2, 0.3, 0.25, 0.25]))
    springs = Prescribed("springs", skin, (0, 1, 2), Rest(), stiffness)
    state = session.solve(Body(mesh, acting, (springs,), (0.0, 1.0)), settings(element)).last
    assert state.forces["springs"] == pytest.approx([0, 0, load], abs=1e-11)
    # The load acts at x = 1, y = z = 1/2: about the origin its moment is (-1/2, 1, 0) load, to the first order of its turning.
    assert state.moments["springs"] == pytest.approx([load / 2, -load, 0], abs=0.01 * load)
    # Where the points go with the block, the springs' areas make up the load.
    rigid, *_ = np.linalg.lstsq(np.column_stack([mesh.points, np.ones(len(mesh.points))]), state.points - mesh.points)
    moved = np.column_stack([at, np.ones(4)]) @ rigid
    assert stiffness * skin.areas @ moved == pytest.approx([0, 0, -load], abs=0.01 * load)


@BOTH
def test_stiff_springs_come_near_to_what_they_stand_for(element, session) -> None:
    stretch, forces = Affine(((0.0, 0.0, 0.0),) * 3, (0.0, 0.0, 0.2)), []
    fixed = tuple(Prescribed(face, face, (axis,), Rest()) for axis, face in enumerate(("x0", "y0", "z0")))
    for stiffness in (None, 1e2, 1e3):
        pulled = Prescribed("top", "z1", (2,), stretch, stiffness)
        state = session.solve(Body(box(element), FLESH, (*fixed, pulled), (0.0, 1.0)), settings(element)).last
        forces.append(state.forces["top"][2])
    # Ten times stiffer, ten times nearer, up to what the body's 0.03 N/mm are of the springs' 100 N/mm.
    assert (forces[1] - forces[0]) / (forces[2] - forces[0]) == pytest.approx(10, rel=1e-3)


def tied(anchor: tuple[float, float, float], path, stiffness: float) -> Body:
    """A block of 1 mm on smooth planes whose top is tied to an ``anchor`` by tendons of a ``stiffness`` [MPa/mm]. Their points make
    up a rule on the facets that is exact for squares, so that equal tensions are a uniform traction.
    """
    mesh = box("P2/P1")
    facets = mesh.facets["z1"]
    places, areas = skins.points(mesh.points[facets], np.ones((len(facets), 3)))
    cells = [np.isin(mesh.cells, facet).sum(axis=1).argmax() for facet in facets]
    fixed = tuple(Prescribed(face, face, (axis,), Rest()) for axis, face in enumerate(("x0", "y0", "z0")))
    tendons = Prescribed("tendon", Skin(np.repeat(cells, 3), places, areas), (0, 1, 2), path, stiffness, anchor)
    return Body(mesh, FLESH, (*fixed, tendons), (0.0, 1.0))


def test_a_block_and_a_tendon_in_series_share_the_extension(session) -> None:
    """The anchor is 1e4 mm away, so that lines are parallel to 1e-4, and is pulled by 1 mm: ``mu (l - l^-2) = k (1 - (l - 1))``
    per area. The bulk modulus is a hundred times the shear modulus: the volume grows by 3e-3, the length by a third of that.
    """
    stiffness, mu = 0.02, 0.01
    body = tied((0.5, 0.5, 1e4), Affine(((0.0,) * 3,) * 3, (0.0, 0.0, 1.0)), stiffness)
    state = session.solve(body, settings("P2/P1")).last
    stretch = brentq(lambda one: mu * (one - one**-2) - stiffness * (2 - one), 1.0, 2.0)
    top = state.points[body.mesh.points[:, 2] == 1, 2]
    assert top == pytest.approx(stretch, abs=2e-3)
    assert state.forces["tendon"][2] == pytest.approx(stiffness * (2 - top.mean()), rel=1e-4)
    assert np.ptp(top) < 1e-4


def test_a_slack_tendon_does_not_push(session) -> None:
    body = tied((0.5, 0.5, 3.0), Affine(((0.0,) * 3,) * 3, (0.0, 0.0, -1.0)), 0.02)
    state = session.solve(body, settings("P2/P1")).last
    assert state.points == pytest.approx(body.mesh.points, abs=1e-9)
    assert np.abs(state.forces["tendon"]).max() == 0


def test_tendons_pull_along_their_lines_however_far_the_bone_turns(session) -> None:
    """All lines pass through the anchor: its place, by a turn of 1.2 rad, times the force is their moment, to the residual."""
    anchor, turn = np.array([0.5, 3.0, 1.5]), Turn((1.0, 0.0, 0.0), 1.2)
    body = tied(tuple(anchor), turn, 0.02)
    state = session.solve(body, settings("P2/P1", first_step=0.2)).last
    (there,) = anchor + turn(anchor[None], 1.0)
    assert np.linalg.norm(state.forces["tendon"]) > 1e-3
    assert state.moments["tendon"] == pytest.approx(np.cross(there, state.forces["tendon"]), abs=1e-9)
    off = sum(state.forces.values())
    assert off == pytest.approx(np.zeros(3), abs=1e-9)
