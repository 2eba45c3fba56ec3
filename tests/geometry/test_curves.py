"""Curves from few points against closed forms and properties."""

import numpy as np
import pytest
from scipy.interpolate import BPoly

from fem_reference.foundations.errors import InputError
from fem_reference.geometry import curves

POINTS = np.array([[0.0, 0.0, 1.0], [1.0, 2.0, 0.0], [3.0, 2.0, 1.0], [4.0, -1.0, 2.0], [7.0, 0.0, 0.0]])
INTERPOLATING = ["piecewise linear", "Catmull-Rom, uniform", "Catmull-Rom, centripetal", "Gaussian RBF"]


@pytest.mark.parametrize("name", sorted(curves.TECHNIQUES))
def test_ends_are_met_and_a_turned_curve_is_the_curve_turned(name: str) -> None:
    make, _ = curves.TECHNIQUES[name]
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3))).Q
    t = np.linspace(0, 1, 9)
    np.testing.assert_allclose(make(POINTS)(t[[0, -1]]), POINTS[[0, -1]], atol=1e-9)
    np.testing.assert_allclose(make(2 * POINTS @ turn.T + 5)(t), 2 * make(POINTS)(t) @ turn.T + 5, atol=1e-8)


@pytest.mark.parametrize("name", sorted(curves.TECHNIQUES))
def test_points_in_reverse_give_the_curve_in_reverse(name: str) -> None:
    make, _ = curves.TECHNIQUES[name]
    t = np.linspace(0, 1, 12)
    np.testing.assert_allclose(make(POINTS[::-1])(1 - t), make(POINTS)(t), atol=1e-8)


@pytest.mark.parametrize("name", INTERPOLATING)
def test_interpolating_curves_pass_all_points(name: str) -> None:
    exponent = {"Catmull-Rom, uniform": 0.0, "Catmull-Rom, centripetal": 0.5}.get(name, 1.0)
    found = curves.TECHNIQUES[name][0](POINTS)(curves.knots(POINTS, exponent))
    np.testing.assert_allclose(found, POINTS, atol=1e-9)


def test_fourier_passes_equidistant_points_and_keeps_a_sine() -> None:
    t = np.linspace(0, 1, 9)
    wave = np.stack([10 * t, np.sin(2 * np.pi * t)], axis=1)
    fine = np.linspace(0, 1, 40)
    # The second of the sines is all there is; chord steps differ, but its samples are equidistant in t.
    np.testing.assert_allclose(curves.fourier(wave)(fine)[:, 1], np.sin(2 * np.pi * fine), atol=1e-12)


def test_bezier_is_de_casteljau() -> None:
    for t in (0.2, 0.5, 0.9):
        rest = POINTS
        while len(rest) > 1:
            rest = (1 - t) * rest[:-1] + t * rest[1:]
        np.testing.assert_allclose(curves.bezier(POINTS)(np.array([t]))[0], rest[0], atol=1e-12)


def test_uniform_catmull_rom_is_the_matrix_of_the_report() -> None:
    """Equation (3.2), between the second and the third point of four."""
    matrix = np.array([[0, 1, 0, 0], [-0.5, 0, 0.5, 0], [1, -2.5, 2, -0.5], [-0.5, 1.5, -1.5, 0.5]])
    t = np.linspace(0, 1, 7)
    wanted = np.stack([t**0, t, t**2, t**3], axis=1) @ matrix @ POINTS[:4]
    np.testing.assert_allclose(curves.catmull_rom(POINTS[:4], 0.0)((1 + t) / 3), wanted, atol=1e-12)


def test_the_printed_bezier_matrix_misses_the_last_point() -> None:
    """Equation (3.1) with the signs as printed does not end in its last point, with those of its second row turned it does."""
    printed = np.array([[1, 0, 0, 0], [3, -3, 0, 0], [3, -6, 3, 0], [-1, 3, -3, 1]])
    mended = printed * np.array([[1], [-1], [1], [1]])
    assert np.abs(printed.sum(axis=0) @ POINTS[:4] - POINTS[3]).max() > 1
    np.testing.assert_allclose(mended.sum(axis=0) @ POINTS[:4], POINTS[3])
    np.testing.assert_allclose(BPoly(POINTS[:4, None], [0, 1])(0.3), 0.3 ** np.arange(4) @ mended @ POINTS[:4])


def crossings(line: np.ndarray) -> int:
    """The number of pairs of segments of a plane ``line`` (n, 2) that cross."""
    start, step = line[:-1], np.diff(line, axis=0)
    gap = start[None] - start[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = (
            (gap[..., 0] * along[..., 1] - gap[..., 1] * along[..., 0])
            / (step[:, None, 0] * step[None, :, 1] - step[:, None, 1] * step[None, :, 0])
            for along in (step[None], step[:, None])
        )
    return int(np.triu((one > 0) & (one < 1) & (other > 0) & (other < 1), 2).sum())


def test_centripetal_segments_have_no_loop_where_uniform_ones_do() -> None:
    """Yuksel, Schaefer and Keyser 2011 (doi 10.1016/j.cad.2010.08.008) prove it for every segment of the centripetal spline."""
    rng, found = np.random.default_rng(1), {0.0: 0, 0.5: 0}
    for _ in range(60):
        points = rng.normal(size=(4, 2))
        points[2] = points[1] + 0.02 * points[2]
        for exponent in found:
            start, stop = curves.knots(points, exponent)[1:3]
            found[exponent] += crossings(curves.catmull_rom(points, exponent)(np.linspace(start, stop, 200))) > 0
    assert found[0.0] > 0
    assert found[0.5] == 0


@pytest.mark.parametrize("bad", [POINTS[:1], POINTS[[0, 1, 1, 2]]])
def test_repeated_points_are_refused(bad: np.ndarray) -> None:
    with pytest.raises(InputError, match="two points or more"):
        curves.knots(bad)
