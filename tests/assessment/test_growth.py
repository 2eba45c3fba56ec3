"""Exponents of costs: exact powers, known noise, and what is no power; the bodies on which they are measured."""

import math

import numpy as np
import pytest

from fem_reference.assessment.growth import Growth, growth
from fem_reference.assessment.solver_table import solver_kinds
from fem_reference.foundations.mesh import check_closed, enclosed_volume, tet_volumes
from fem_reference.studies import growth as study

SIZES = (1e3, 1e4, 3e4, 1e5)


@pytest.mark.parametrize("exponent", [1.0, 4 / 3, 2.0])
def test_an_exact_power_is_found(exponent) -> None:
    found = growth("pbd", "seconds", SIZES, [2e-6 * size**exponent for size in SIZES])
    assert (found.exponent, found.uncertainty) == pytest.approx((exponent, 0), abs=1e-9)
    assert found.at(1e7) == pytest.approx([2e-6 * 1e7**exponent] * 3, rel=1e-6)
    assert found.decades == pytest.approx(2)


def test_the_standard_error_is_that_of_a_line() -> None:
    # In logarithms: (0, 0), (1, 1 + e), (2, 2) has slope 1, residuals -e/3, 2e/3, -e/3, and squared error (6/9 e^2) / 1 / 2.
    off = 0.3
    found = growth("pbd", "seconds", np.exp([0, 1, 2]), np.exp([0, 1 + off, 2]))
    assert (found.exponent, found.uncertainty) == pytest.approx((1, off / math.sqrt(3)))
    middle, low, high = found.at(math.e**3)
    spread = math.sqrt(6 / 9 * off**2 * (1 + 1 / 3 + 2**2 / 2))
    reach = math.tan(math.pi * 0.475) * spread  # of Student's distribution with one degree of freedom, Cauchy's
    assert np.log([middle, low, high]) == pytest.approx([3 + off / 3, 3 + off / 3 - reach, 3 + off / 3 + reach])


def test_intervals_cover_as_often_as_they_say() -> None:
    draw, sizes, exponent, noise = np.random.default_rng(1), np.geomspace(1e3, 1e5, 6), 1.2, 0.1
    errors, uncertainties, hits = [], [], []
    for _ in range(2000):
        values, there = sizes**exponent * np.exp(noise * draw.normal(size=6)), math.exp(noise * draw.normal())
        found = growth("pbd", "seconds", sizes, values)
        _, low, high = found.at(1e7)
        hits.append(low <= 1e7**exponent * there <= high)
        errors.append(found.exponent - exponent)
        uncertainties.append(found.uncertainty**2)
    assert np.mean(hits) == pytest.approx(0.95, abs=0.015)
    assert np.std(errors) == pytest.approx(math.sqrt(np.mean(uncertainties)), rel=0.05)


def test_what_is_no_number_is_left_out() -> None:
    found = growth("pbd", "seconds", (*SIZES, 2e5, 3e5), [*SIZES, 0.0, math.nan], "triangles")
    assert (found.sizes, found.counted) == (SIZES, "triangles")
    assert growth("pbd", "seconds", SIZES[:2], SIZES[:2]) is None
    assert growth("pbd", "seconds", (1, 1, 1, 2), (1, 2, 3, 4)) is None  # two sizes are no slope with an error
    assert Growth("pbd", "s", (1.0, 2.0, 4.0), (1e-3, 1.0, 1e-3), 300.0, 100.0).at(1e9)[2] == math.inf


@pytest.mark.parametrize("subdivisions", [0, 1, 2, 3])
def test_the_ellipsoid_is_closed_and_attached(subdivisions) -> None:
    made = study.ellipsoid(subdivisions)
    surface = check_closed(made.surface)
    assert len(surface.triangles) == 20 * 4**subdivisions
    of_ellipsoid = 4 / 3 * math.pi * study.SHORT**2 * study.LONG
    assert enclosed_volume(surface.points, surface.triangles) < of_ellipsoid
    if subdivisions == 3:
        assert enclosed_volume(surface.points, surface.triangles) == pytest.approx(of_ellipsoid, rel=0.02)
    assert all(len(entry.vertices) for entry in made.attached)
    assert made.bones[1].pose(study.ITERATIONS) != pytest.approx(np.eye(4))
    assert all((bone.shape.sample(surface.points).distance > -1e-9).all() for bone in made.bones)


def test_the_spindle_has_tets_and_ends() -> None:
    made = study.spindle(1, 4)
    check_closed(made.surface)
    assert tet_volumes(made.mesh.points, made.mesh.tets).min() > 0
    for entry, end in zip(made.attached, (-1, 1), strict=True):
        z = made.surface.points[entry.vertices, 2]
        assert z == pytest.approx(np.full(len(z), end * study.timing.LENGTH / 2))
        assert len(np.unique(made.mesh.facets[entry.attachment])) == len(z)


@pytest.mark.slow
@pytest.mark.parametrize(
    "candidate", [each for row in solver_kinds() for each in row.candidate], ids=lambda one: one.name
)
def test_candidates_of_the_table_are_measured(candidate) -> None:
    said: list[str] = []
    found = study.of_candidate(candidate, said.append, most=3)
    iteration = next(one for one in found if one.cost == "iteration")
    assert (iteration.solver, len(said)) == (candidate.name, 3)
    assert 0 < iteration.exponent < 3


@pytest.mark.slow
@pytest.mark.usefixtures("fem_lab")  # it skips where nothing can be solved
def test_the_reference_is_measured_by_phase() -> None:
    found = {one.cost: one for one in study.of_reference(print, ((1, 3), (1, 6), (1, 9)))}
    assert {*study.PHASES, "total"} <= set(found)
    assert all(one.counted == "unknowns" for one in found.values())
    assert all(np.greater(found["total"].values, found["assembly"].values))
