"""Bodies of closed form as triangles: closed, outward, with their vertices on the body, and as near it as their sides are many."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.foundations.mesh import Floats, check_closed, enclosed_volume
from fem_reference.geometry.rigid_bodies import Box, Capsule, Cylinder, HalfSpace, Sampled, Sphere
from fem_reference.geometry.tessellation import tessellated

BESIDE = np.array([[-50.0, 10, -50], [50, 90, 50], [0, 30, 0]])
START, END = (10.0, -20.0, 5.0), (13.0, -8.0, 9.0)  # 3, 12 and 4 apart: 13
BODIES = [
    # body, its volume in closed form [mm3]
    (Box((1, 2, 3), (40, 10, 30), 0.0), 12000),
    (
        Box((1, 2, 3), (40, 10, 30), 2.0),
        36 * 6 * 26 + 2 * 2 * (36 * 6 + 36 * 26 + 6 * 26) + np.pi * 4 * 68 + np.pi * 32 / 3,
    ),
    (Box((1, 2, 3), (40, 10, 30), 5.0), 2 * 5 * 30 * 20 + np.pi * 25 * 50 + np.pi * 500 / 3),
    (Sphere((-4, 5, 6), 3.0), 36 * np.pi),
    (Capsule(START, END, 2.0), np.pi * 4 * 13 + np.pi * 32 / 3),
    (Cylinder(START, END, 2.0), np.pi * 4 * 13),
]
CASES = [pytest.param(body, volume, id=f"{type(body).__name__}-{i}") for i, (body, volume) in enumerate(BODIES)]


@pytest.mark.parametrize("body", [body for body, _ in BODIES])
def test_vertices_lie_on_the_body_and_triangles_bound_it(body: Box) -> None:
    surface = tessellated(body, BESIDE, "bone")
    assert check_closed(surface) is surface  # which it would not be if it were inside out
    assert surface.place == "bone"
    # Round-off of coordinates up to 50 mm.
    assert_allclose(body.sample(surface.points).distance, 0, atol=1e-13)


@pytest.mark.parametrize(("body", "volume"), CASES)
def test_the_volume_converges_as_arcs_do_by_their_chords(body: Box, volume: float) -> None:
    lost = [1 - tessellation_volume(body, turn) / volume for turn in (16, 32, 64)]
    if getattr(body, "rounding", 1) == 0:
        assert lost == pytest.approx([0, 0, 0], abs=1e-14)
        return
    # Inside, and second order: from one step to the next a quarter, but for terms of fourth order, (pi / 16)^2 = 4 %.
    assert 0 < lost[2] < 0.01
    assert lost[0] / lost[1] == pytest.approx(4, rel=0.04)
    assert lost[1] / lost[2] == pytest.approx(4, rel=0.01)


def tessellation_volume(body: Box, turn: int) -> float:
    surface = tessellated(body, BESIDE, "bone", turn)
    return enclosed_volume(surface.points, surface.triangles)


def test_a_cylinder_is_a_prism_over_a_regular_polygon() -> None:
    # Its base has the area n / 2 r^2 sin(2 pi / n).
    for turn in (16, 64):
        expected = turn / 2 * 4 * np.sin(2 * np.pi / turn) * 13
        assert tessellation_volume(Cylinder(START, END, 2.0), turn) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("body", [body for body, _ in BODIES[2:]], ids=lambda body: type(body).__name__)
def test_triangles_lie_little_inside(body: Sphere) -> None:
    surface = tessellated(body, BESIDE, "bone")
    corners = surface.points[surface.triangles]
    middles = np.concatenate([corners.mean(axis=1), *((corners[:, i] + corners[:, i - 1]) / 2 for i in range(3))])
    depth = -body.sample(middles).distance
    # Cells of pi / 32 a side are rhombi of at least 60 degrees: half a diagonal spans at most sqrt(3) pi / 64 = 0.085, and its
    # middle lies 0.085^2 / 2 = 0.36 % of the radius inside.
    assert depth.max() < 0.0036 * getattr(body, "radius", 5.0)
    assert depth.min() > -1e-13


@pytest.mark.parametrize("normal", [(0, 1, 0), (0, -3, 0), (1, 2, -3)])
def test_a_half_space_is_a_slab_behind_its_plane_that_reaches_past_what_is_beside_it(normal: tuple[float, ...]) -> None:
    space = HalfSpace((5, 10, -7), normal)
    surface = tessellated(space, BESIDE, "bone")
    assert check_closed(surface) is surface
    distance = space.sample(surface.points).distance
    size = float(np.linalg.norm([100, 80, 100]))
    # Half of its eight corners lie in the plane, the others a tenth of the size behind it.
    assert np.sort(distance) == pytest.approx([-size / 10] * 4 + [0] * 4, abs=1e-12)
    # Seen along the normal, a ball twice as large as the points' own, about their middle, is covered.
    along = np.divide(normal, np.linalg.norm(normal))
    face = surface.points[distance > -1]
    flat = face - [0, 50, 0] - ((face - [0, 50, 0]) @ along)[:, None] * along
    assert (np.linalg.norm(flat, axis=1) > 2 * size / 2).all()
    assert np.abs(flat.mean(axis=0)).max() < 1e-12


def test_another_body_has_no_triangles() -> None:
    class Elsewhere:
        def sample(self, points: Floats) -> Sampled:
            raise NotImplementedError

    with pytest.raises(TypeError, match="Elsewhere is not a body of a simple shape"):
        tessellated(Elsewhere(), BESIDE, "bone")
