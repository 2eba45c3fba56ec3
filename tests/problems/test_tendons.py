"""Tendons that pull: the surface that they pull at, their stiffness, and what they are refused for."""

import numpy as np
import pytest
import shapes

from fem_reference.effects import make
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines
from fem_reference.foundations.motion import RigidMotion
from fem_reference.problems.body import Prescribed
from fem_reference.problems.setup import AttachedVertices, Bone, Setup
from fem_reference.problems.tendons import force_name, pulling

MESH = shapes.box((4, 4, 10), (10.0, 10.0, 40.0))
BAR = shapes.skin(MESH)
LIFT = RigidMotion((0, 0, 1), None, (0.0, 10.0), (0.0, 20.0))
BONES = (Bone("low", shapes.sphere(1), None), Bone("high", shapes.sphere(1), LIFT))
FAR = (0.0, 0.0, 100.0)
# The first reaches the attachment of the top, the second ends in the middle of a side, 19 mm below it.
LINES = Polylines(np.array([[5.0, 5, 0], [5, 5, 40], [5, 5, 0], [10, 6, 21]]), np.array([0, 2, 4]))
TENDON = make("tendon", on="top", stiffness="20 N/mm", reach="6 mm")


def bar(tendon: tuple[float, float, float] | None = FAR) -> Setup:
    ends = [np.flatnonzero(BAR.points[:, 2] == z) for z in (0.0, 40.0)]
    top = AttachedVertices("top", BONES[1], ends[1], 0.1, None if tendon is None else np.array(tendon))
    return Setup(BAR, BONES, (AttachedVertices("bottom", BONES[0], ends[0], 0.1), top), (0, 10), None)


def springs(rest: Setup, *effects, lines: Polylines = LINES) -> tuple[Prescribed, ...]:
    return tuple(pulling(rest, MESH, lines, effects))


def test_it_pulls_about_the_ends_that_go_on_by_it_and_nowhere_else() -> None:
    """Vertices are 2.5 and 4 mm apart: the attached share falls from 1 to 0 within an edge of 4.8 mm beyond the reach. The force
    per length of all points together is the given one, whatever their area.
    """
    (found,) = springs(bar(), make("neo_hooke", mu="10 kPa"), TENDON)
    away = np.linalg.norm(found.on.points - [10, 6, 21], axis=1)
    assert away[found.on.areas > 0].max() < 6 + 4.8
    assert np.pi * 4**2 < found.on.areas.sum() < np.pi * 9**2
    assert found.stiffness * found.on.areas.sum() == pytest.approx(20)
    assert (found.name, found.anchor) == (force_name("top"), FAR)
    assert found.path(np.array([FAR]), 5.0) == pytest.approx(np.array([[0, 0, 10.0]]))


def test_what_is_attached_already_is_left_out() -> None:
    (found,) = springs(bar(), make("tendon", on="top", stiffness="20 N/mm", reach="21 mm"))
    attached = (found.on.points[:, 2] > 40 - 1e-9) & (found.on.areas > 0)
    assert not attached.any()


def test_a_tendon_of_nothing_is_refused() -> None:
    assert springs(bar(), make("neo_hooke", mu="10 kPa")) == ()
    with pytest.raises(InputError, match=r'Tendon on top: got the attachment "top" without a tendon, want landmarks'):
        springs(bar(None), TENDON)
    reaching = Polylines(LINES.points[:2], LINES.offsets[:2])
    with pytest.raises(
        InputError, match="Tendon on top: got no fibre that continues as this tendon, want fibres that end"
    ):
        springs(bar(), TENDON, lines=reaching)
    with pytest.raises(InputError, match=r"Tendon on top\.reach: got 0\.1 mm, within which no triangle is free"):
        springs(bar(), make("tendon", on="top", stiffness="20 N/mm", reach="0.1 mm"))
