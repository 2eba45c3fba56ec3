"""What entries share: materials and clamps in few words, and what is read from states."""

import numpy as np
import pytest

from fem_reference.problems.paths import Rest
from fem_reference.runs.store import Frame, Outcome, collected
from fem_reference.verification import parts


def test_clamps_stay_and_slides_stay_in_their_planes() -> None:
    (base,) = parts.clamped("base")
    assert (base.on, base.components, base.path) == ("base", (0, 1, 2), Rest())
    assert [one.components for one in parts.sliding("x1", "y0", "z1")] == [(0,), (1,), (2,)]
    assert [one.on for one in parts.SYMMETRY] == ["x0", "y0", "z0"]


@pytest.mark.parametrize(("element", "name"), [("P2", "IncompressiblePenalty"), ("Q1/P0", "Incompressible")])
def test_a_material_resists_volume_change_as_its_element_does(element, name) -> None:
    law, resists = parts.neo_hooke(0.01, 5.0, element)
    assert (type(law).__name__, type(resists).__name__) == ("NeoHooke", name)
    assert resists.parameters[0][1] == 5.0


def test_frames_are_even_and_begin_at_rest() -> None:
    assert parts.frames(2, 4) == (0.0, 0.5, 1.0, 1.5, 2.0)


def test_distances_are_those_of_points() -> None:
    points = np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0]])
    assert parts.farthest(points, np.zeros((2, 3))) == 5.0
    assert parts.nearest(points, (2.0, 2.0, 0.0)) == 1


def test_a_rate_is_that_of_an_exponential() -> None:
    # 10 + e^(-3 t) at t = 0.5 and 1.5, above a height of 10 at rest: the rate is 3.
    heights = (10.0, 10 + np.exp(-1.5), 10 + np.exp(-4.5))
    states = [Frame(i, points=np.array([[0.0, 0.0, 0.0], [0.0, 0.0, z]])) for i, z in enumerate(heights)]
    run = collected(states, Outcome("converged", "", {}))
    assert parts.relaxation_rate(run, (1, 2), 1.0) == pytest.approx(3, rel=1e-12)
