"""Friction between parts of a surface in load steps: what sticks goes along, what slides loses work, and a turn costs nothing."""

from dataclasses import replace

import numpy as np
import pytest

from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Affine, Turn
from fem_reference.problems.touching import Touching
from fem_reference.verification import parts

pytestmark = pytest.mark.slow

LAW = Touching("low_z1", "high_z0", 0.01, 0.002, 0.3)


def pair(path, law: Touching = LAW, below=None) -> Body:
    """A block on a clamped one, pressed from the start, whose top goes a ``path``; the bottom goes the path ``below``."""
    low, high = (
        shapes.box((2, 2, 1), (1.0, 1.0, 0.3), "hexahedron"),
        shapes.box((1, 1, 1), (0.5, 0.5, 0.3), "hexahedron"),
    )
    mesh = shapes.joined({"low": low, "high": replace(high, points=high.points + [0.2, 0.2, 0.299])})
    ground = (Prescribed("low_z0", "low_z0", (0, 1, 2), below),) if below else parts.clamped("low_z0")
    top = Prescribed("top", "high_z1", (0, 1, 2), path)
    return Body(mesh, parts.neo_hooke(0.01, 0.1), (*ground, top), (0.0, 1.0), touching=(law,))


def solved(lab, body: Body):
    return lab.solve(body, "Q1/P0", first_step=0.25, residual=1e-13).last


def shifted(x: float) -> Affine:
    return Affine(parts.NO_GRADIENT, (x, 0.0, 0.0))


def test_a_small_shift_sticks_and_loses_no_work(fem_lab) -> None:
    state = solved(fem_lab, pair(shifted(5e-5)))
    force = state.forces["low_z1 on high_z0"]
    assert -0.3 * force[2] < force[0] < -0.01 * force[2]
    assert state.scalars["touching_friction_work"] == pytest.approx(0, abs=1e-13)


def test_a_large_one_slides_and_a_body_without_friction_feels_nothing_of_it(fem_lab) -> None:
    rough, smooth = (solved(fem_lab, pair(shifted(0.1), replace(LAW, friction=one))) for one in (0.3, None))
    force, other = rough.forces["low_z1 on high_z0"], smooth.forces["low_z1 on high_z0"]
    assert force[0] == pytest.approx(-0.3 * force[2], rel=5e-3)  # faces tilt by the pressure over the moduli
    assert abs(other[0]) < 1e-3 * other[2]
    assert "touching_friction_work" not in smooth.scalars
    # Almost all of the path is slip.
    assert rough.scalars["touching_friction_work"] == pytest.approx(abs(force[0]) * 0.1, rel=0.05)


def test_a_turn_of_both_is_no_slip(fem_lab) -> None:
    turn = Turn((0.0, 1.0, 0.0), 0.5, (0.0, 0.0, 0.0))
    still, turned = solved(fem_lab, pair(shifted(0.0))), solved(fem_lab, pair(turn, below=turn))
    c, s = np.cos(0.5), np.sin(0.5)
    rotation = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    # The residual of 1e-13 N, at several unknowns.
    assert turned.forces["low_z1 on high_z0"] == pytest.approx(rotation @ still.forces["low_z1 on high_z0"], abs=1e-11)
    assert turned.scalars["touching_friction_work"] == pytest.approx(still.scalars["touching_friction_work"], abs=1e-12)
