"""Templates mapped to sections: straight, pennate and bent fibres as closed forms have them."""

from collections.abc import Callable

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines, TetMesh
from fem_reference.geometry.embedding import embed
from fem_reference.geometry.fibre_templates import contours, mapped, template
from fem_reference.geometry.fibres import fibre_field

INNER = 20.0  # radius of the ring [mm]
X = np.array([1.0, 0.0, 0.0])


def _prism() -> TetMesh:
    """A prism of 14 x 10 x 60 mm along z."""
    return shapes.box((5, 4, 12), (14.0, 10.0, 60.0))


def _ring() -> TetMesh:
    """A quarter ring of 10 x 14 mm about the y axis, from z = 0 ("bottom") to x = 0 ("top")."""
    bar = shapes.box((4, 5, 24), (10.0, 14.0, np.pi / 2))
    across, along, angle = bar.points.T
    points = np.stack([(INNER + across) * np.cos(angle), along, (INNER + across) * np.sin(angle)], axis=1)
    return TetMesh(points, bar.tets, bar.facets)


def _cylinder() -> TetMesh:
    """A cylinder of radius 8 mm and length 50 mm along z."""
    bar = shapes.box((6, 6, 12), (2.0, 2.0, 50.0))
    flat = bar.points[:, :2] - 1
    shrink = np.abs(flat).max(axis=1) / np.maximum(np.linalg.norm(flat, axis=1), 1e-12)
    return TetMesh(np.column_stack([8 * flat * shrink[:, None], bar.points[:, 2]]), bar.tets, bar.facets)


def _frilled() -> TetMesh:
    """A prism of 14 x 10 x 60 mm, half of one side of which rises in three waves, 6 mm high midway."""
    bar = shapes.box((21, 4, 16), (14.0, 10.0, 60.0))
    across, up, along = bar.points.T
    waves = np.where(across > 7, np.sin(3 * np.pi * across / 7) ** 2, 0)
    raised = up * (1 + 0.6 * waves * np.sin(np.pi * along / 60))
    return TetMesh(np.stack([across, raised, along], axis=1), bar.tets, bar.facets)


def _screw() -> TetMesh:
    """A bar of 16 x 8 x 80 mm that turns by 90 degrees about its axis, which bends to a radius of 60 mm."""
    bar = shapes.box((6, 4, 24), (16.0, 8.0, 80.0))
    across, up, along = (bar.points - [8, 4, 0]).T
    turn, bend = np.pi / 2 * along / 80, along / 60
    out, level = 60 + across * np.cos(turn) - up * np.sin(turn), across * np.sin(turn) + up * np.cos(turn)
    return TetMesh(np.stack([out * np.cos(bend), level, out * np.sin(bend)], axis=1), bar.tets, bar.facets)


def _sharpest(lines: Polylines) -> float:
    """The greatest angle [deg] between two segments that follow each other."""
    pieces = np.diff(lines.points.reshape(-1, 40, 3), axis=1)
    pieces /= np.linalg.norm(pieces, axis=2, keepdims=True)
    return float(np.degrees(np.arccos(np.clip((pieces[:, 1:] * pieces[:, :-1]).sum(axis=2), -1, 1)).max()))


def _lines(mesh: TetMesh, count: int = 12, pennation: float = 0.0, towards: np.ndarray = X) -> Polylines:
    field = fibre_field(mesh, "bottom", "top")
    return mapped(field, contours(field, 20, towards), count, pennation)


def test_fibres_of_a_prism_are_straight_and_as_long() -> None:
    lines = _lines(_prism())
    assert_allclose(lines.lengths(), 60, rtol=1e-6)
    assert_allclose(np.ptp(lines.points.reshape(12, 40, 3)[:, :, :2], axis=1), 0, atol=1e-3)


def test_fibres_of_a_cylinder_are_straight_and_as_long() -> None:
    """The rims of its sections are polygons whose corners differ a little from section to section."""
    lines = _lines(_cylinder())
    assert_allclose(lines.lengths(), 50, rtol=5e-4)
    assert_allclose(np.ptp(lines.points.reshape(12, 40, 3)[:, :, :2], axis=1), 0, atol=0.3)


def test_a_prism_has_the_template_to_scale() -> None:
    """A rectangle is mapped linearly: the places in the square are the places in the prism, over its sides."""
    lines = _lines(_prism())
    assert_allclose(lines.points.reshape(12, 40, 3)[:, 20, :2] / [14, 10], template(12, 0.0)[:, 0, :2], atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [10.0, 25.0])
def test_pennate_fibres_have_the_angle_asked_for(degrees: float) -> None:
    lines = _lines(_prism(), pennation=np.radians(degrees)).points.reshape(12, 40, 3)
    along = lines[:, -1] - lines[:, 0]
    assert_allclose(np.degrees(np.arctan2(along[:, 0], along[:, 2])), degrees, atol=1e-3)
    assert_allclose(along[:, 1], 0, atol=1e-3)
    ends = lines[:, [0, -1]]
    at_ends = np.isclose(ends[:, :, 2], [0, 60], atol=1e-4) | np.isclose(ends[:, :, 0], [0, 14], atol=1e-3)
    assert at_ends.all(), "each end is on an attachment or on a side"


def test_fibres_of_a_bent_bar_are_arcs_as_long() -> None:
    lines = _lines(_ring())
    radii = np.linalg.norm(lines.points[:, [0, 2]], axis=1).reshape(12, 40)
    assert np.ptp(radii, axis=1).max() < 0.15
    assert_allclose(lines.lengths(), radii.mean(axis=1) * np.pi / 2, rtol=3e-3)
    assert embed(_ring(), lines.points).outside.max() < 0.05  # the sagitta of the ring's facets


@pytest.mark.slow
@pytest.mark.parametrize("count", [10, 20, 40])
def test_fibres_pass_where_a_part_of_the_outline_grows(count: int) -> None:
    """The waves more than double half of one side; fibres keep their place across the prism to a tenth of its width. With rims
    shared out by their lengths they moved by 8 mm.
    """
    field = fibre_field(_frilled(), "bottom", "top")
    lines = mapped(field, contours(field, count, X), 16)
    assert np.ptp(lines.points.reshape(16, 40, 3)[:, :, 0], axis=1).max() < 1.4


@pytest.mark.slow
@pytest.mark.parametrize("count", [10, 40])
def test_fibres_of_a_bar_that_bends_and_twists_turn_gently(count: int) -> None:
    """The bend is 80 mm / 60 mm in 39 steps, 2 degrees each; the helix of a corner, 8.9 mm from the axis, by less than 1 more.
    Twice that with any number of sections.
    """
    field = fibre_field(_screw(), "bottom", "top")
    assert _sharpest(mapped(field, contours(field, count, X), 16)) < 6


@pytest.mark.slow
@pytest.mark.parametrize("pennation", [0.0, 0.3])
@pytest.mark.parametrize("shape", [_ring, _screw, _frilled])
def test_turned_scaled_and_renumbered_meshes_give_the_same_fibres(
    shape: Callable[[], TetMesh], pennation: float
) -> None:
    ring, rng = shape(), np.random.default_rng(3)
    turn, order = Rotation.random(rng=rng), rng.permutation(len(ring.points))
    number = np.argsort(order)
    moved = TetMesh(
        3 * turn.apply(ring.points)[order] + 100,
        number[ring.tets],
        {name: number[facets] for name, facets in ring.facets.items()},
    )
    lines, found = (_lines(mesh, pennation=pennation, towards=to) for mesh, to in [(ring, X), (moved, turn.apply(X))])
    assert_allclose(found.points, 3 * turn.apply(lines.points) + 100, atol=1e-3)


def test_fibres_of_a_template_never_cross() -> None:
    points = _lines(_ring(), 30).points.reshape(30, 40, 3)
    apart = np.linalg.norm(points[:, None] - points[None], axis=3).min(axis=2) + 9 * np.eye(30)
    assert apart.min() > 0.2


def test_what_cannot_be_is_an_error() -> None:
    field = fibre_field(_prism(), "bottom", "top")
    with pytest.raises(InputError, match=r"kohout_kukacka\.towards.*a direction across the muscle"):
        contours(field, 20, np.array([0.0, 0.0, 1.0]))
