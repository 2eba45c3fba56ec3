"""The contract of metrics: zero against itself, a known change gives a known value, NaN is never a pass.

Units are stated, and rigid motion of both runs changes nothing.
"""

from dataclasses import replace

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from fem_reference.assessment.judge import judge
from fem_reference.foundations.mesh import Polylines, Surface, check_closed
from fem_reference.metrics import Measure, MeasurementContext, at_rest, change, measure
from fem_reference.metrics.fibre_length import extension_error
from fem_reference.runs.store import Outcome, Run

RADIUS = 40.0
CENTRE = np.array([146.0, 238.0, -431.0])
UNITS = {
    "volume": {"deviation": "%", "deviation_volume": "mm3"},
    "penetration": {"deepest": "mm", "volume": "mm3"},
    "fibre_length": {
        "mean": "mm",
        "rms": "mm",
        "max": "mm",
        "mean_percent": "%",
        "rms_percent": "%",
        "max_percent": "%",
    },
    "surface_deviation": {
        "rms": "mm",
        "p95": "mm",
        "max": "mm",
        "rms_percent": "%",
        "p95_percent": "%",
        "max_percent": "%",
    }
    | {"distance_mean": "mm", "distance_rms": "mm", "hausdorff": "mm"}
    | {"distance_mean_percent": "%", "distance_rms_percent": "%", "hausdorff_percent": "%"},
}


def _sphere(count: int = 500) -> Surface:
    """A sphere whose vertices crowd at the top, so that a mean over vertices is not a mean over the area."""
    height = 1 - 2 * ((np.arange(count) + 0.5) / count) ** 1.5
    angle = np.pi * (3 - np.sqrt(5)) * np.arange(count)
    across = np.sqrt(1 - height**2)
    unit = np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=1)
    triangles = ConvexHull(unit).simplices
    inward = np.linalg.det(unit[triangles]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return check_closed(Surface(RADIUS * unit + CENTRE, triangles))


def _fibres() -> Polylines:
    """Five straight fibres of 20 to 60 mm inside the sphere."""
    lines = [
        CENTRE + np.linspace([x, -length / 2, 5.0], [x, length / 2, -5.0], 12)
        for x, length in ((-20, 20.0), (-10, 30.0), (0, 60.0), (10, 50.0), (20, 40.0))
    ]
    return Polylines(np.concatenate(lines), np.arange(6) * 12)


SPHERE, FIBRES = _sphere(), _fibres()


def _run(frames: list[np.ndarray], fibres: list[np.ndarray] | None = None, rest: Surface = SPHERE) -> Run:
    """A run through ``frames``, with positions of FIBRES where given."""
    return Run(
        name="run",
        solver="recorded",
        outcome=Outcome("converged", ""),
        numbers=tuple(range(len(frames))),
        surface=rest,
        positions=np.array(frames),
        fibres=None if fibres is None else FIBRES,
        fibre_positions=None if fibres is None else np.array(fibres),
    )


def _scaled(points: np.ndarray, factor: float) -> np.ndarray:
    return CENTRE + factor * (points - CENTRE)


def _wavy(points: np.ndarray) -> np.ndarray:
    """A smooth deformation of some 5 mm that is not affine."""
    return points + 5 * np.sin((points - CENTRE)[:, [1, 2, 0]] / 15)


REFERENCE = _run([SPHERE.points, _wavy(SPHERE.points)], [FIBRES.points, _wavy(FIBRES.points)])
CONTEXT = MeasurementContext.of(REFERENCE, FIBRES, ())


def _values(run: Run, reference: Run, context: MeasurementContext) -> dict[str, np.ndarray]:
    return {f"{each.metric}.{each.statistic}": each.values for each in measure(run, reference, context)}


def _find(measures: tuple[Measure, ...], name: str) -> Measure:
    (found,) = (each for each in measures if f"{each.metric}.{each.statistic}" == name)
    return found


def test_units_and_shapes_are_stated() -> None:
    measures = measure(REFERENCE, REFERENCE, CONTEXT)
    for metric, statistics in UNITS.items():
        assert {each.statistic: each.unit for each in measures if each.metric == metric} == statistics
    for each in measures:
        assert each.values.shape == (2,)
        assert len(each.where) == 2


@pytest.mark.parametrize("interior", [True, False])
def test_zero_against_itself(interior: bool) -> None:
    run = REFERENCE if interior else replace(REFERENCE, fibres=None, fibre_positions=None)
    for name, values in _values(run, REFERENCE, CONTEXT).items():
        assert np.abs(values).max() < 1e-12, name


def test_a_shift_of_one_mm_is_one_mm() -> None:
    shift = np.array([2.0, -1.0, 2.0]) / 3
    run = replace(REFERENCE, positions=REFERENCE.positions + shift, fibre_positions=REFERENCE.fibre_positions + shift)
    found = _values(run, REFERENCE, CONTEXT)
    for statistic in ("rms", "p95", "max"):
        assert_allclose(found[f"surface_deviation.{statistic}"], 1, rtol=1e-12)
    for statistic in ("rms_percent", "max_percent"):
        assert_allclose(found[f"surface_deviation.{statistic}"], 100 / CONTEXT.travel, rtol=1e-12)
    assert (found["surface_deviation.hausdorff"] <= 1 + 1e-12).all()
    for name in ("volume.deviation", "fibre_length.max", "fibre_length.max_percent"):
        assert np.abs(found[name]).max() < 1e-9, name  # round-off of 1e5 mm3 and of coordinates near 500 mm


def test_travel_is_the_greatest_displacement() -> None:
    run = _run([SPHERE.points, SPHERE.points + np.array([3, 4, 0])])
    assert_allclose(MeasurementContext.of(run, FIBRES, ()).travel, 5, rtol=1e-12)


def test_nothing_that_travels() -> None:
    still = _run([SPHERE.points, SPHERE.points])
    run = _run([SPHERE.points, SPHERE.points + np.array([1, 0, 0])])
    found = _values(run, still, MeasurementContext.of(still, FIBRES, ()))
    assert found["surface_deviation.rms_percent"].tolist() == [0, np.inf]
    assert found["surface_deviation.max_percent"].tolist() == [0, np.inf]


@pytest.mark.parametrize("factor", [0.9, 1.05])
def test_scaling_changes_the_volume_by_its_cube(factor: float) -> None:
    still = _run([SPHERE.points])
    found = _values(_run([_scaled(SPHERE.points, factor)]), still, MeasurementContext.of(still, FIBRES, ()))
    assert_allclose(found["volume.deviation"], 100 * (factor**3 - 1), rtol=1e-10)
    inscribed = ConvexHull(SPHERE.points).volume
    assert_allclose(found["volume.deviation_volume"], inscribed * (factor**3 - 1), rtol=1e-10)


def test_concentric_spheres_are_the_difference_of_their_radii_apart() -> None:
    """A vertex of the outer is closest to the same vertex of the inner, which is convex: hausdorff is exact.

    The vertices of the inner are nearer to the outer's facets, by their sagitta at most.
    """
    still = _run([SPHERE.points])
    found = _values(_run([_scaled(SPHERE.points, 1.1)]), still, MeasurementContext.of(still, FIBRES, ()))
    assert_allclose(found["surface_deviation.hausdorff"], 4, rtol=1e-10)
    assert 4 - 1.1 * _sagitta() < found["surface_deviation.distance_mean"][0] < 4
    assert found["surface_deviation.distance_mean"][0] <= found["surface_deviation.distance_rms"][0] < 4


def _sagitta() -> float:
    """How far the facets of the sphere are below it at most [mm]."""
    a, b, c = (SPHERE.points[SPHERE.triangles[:, corner]] - CENTRE for corner in range(3))
    normals = np.cross(b - a, c - a)
    return float(RADIUS - np.min(np.sum(a * normals, axis=1) / np.linalg.norm(normals, axis=1)))


def test_sliding_is_material_and_not_geometric() -> None:
    """A sphere turned about z: each vertex moves by 2 sin(angle / 2) times its distance from the axis.

    The mean square of that distance is 2/3 R^2; the surface stays but for the sagitta of its facets.
    """
    turn = Rotation.from_rotvec([0, 0, 0.5])
    still = _run([SPHERE.points])
    run = _run([CENTRE + turn.apply(SPHERE.points - CENTRE)])
    found = _values(run, still, MeasurementContext.of(still, FIBRES, ()))
    moved = 2 * np.sin(0.25) * RADIUS
    assert_allclose(found["surface_deviation.rms"], moved * np.sqrt(2 / 3), rtol=0.01)  # areas of flat facets: 0.5 %
    assert_allclose(found["surface_deviation.max"], moved, rtol=0.01)
    assert found["surface_deviation.hausdorff"][0] < _sagitta() < 0.1 * moved
    assert np.abs(found["volume.deviation"][0]) < 1e-9


def test_statistics_are_weighted_by_area() -> None:
    """Equal steps of height cut equal areas off a sphere (Archimedes).

    So if vertices move by their height as a share of the diameter [mm], 95 % of the area moves less than 0.95 mm, and
    the mean square is 1/3 mm2, wherever the vertices crowd.
    """
    share = (SPHERE.points[:, 2] - CENTRE[2]) / (2 * RADIUS) + 0.5
    still = _run([SPHERE.points])
    run = _run([SPHERE.points + share[:, None] * (1, 0, 0)])
    found = _values(run, still, MeasurementContext.of(still, FIBRES, ()))
    assert_allclose(found["surface_deviation.p95"], 0.95, atol=0.01)
    assert_allclose(found["surface_deviation.rms"], np.sqrt(1 / 3), atol=0.01)
    assert np.quantile(share, 0.95) > 0.97  # an unweighted percentile would not pass


def test_geometric_distances_are_weighted_by_area() -> None:
    """The top of a box whose vertices crowd at its rim, raised by less than they are from it.

    Every vertex of the raised top is ``raise_by`` off, and so are those of the old top but at its rim: there the sides still
    pass. By sums of thirds of triangles, in each of both directions: the top has half of the whole area, and the inner vertices
    have the middle cell of 10 x 10 mm, half of each cell of 1 x 10 mm and, of the cells of 1 x 1 mm, two thirds and two sixths.
    """
    ticks, height, raise_by = np.array([0.0, 1, 11, 12]), 3.0, 0.5
    box = shapes.skin(shapes.box((3, 3, 1), (3.0, 3.0, height)))
    rest = box.moved_to(np.column_stack([ticks[box.points[:, :2].round().astype(int)], box.points[:, 2]]))
    raised = rest.points + np.where(rest.points[:, 2:] == height, [0, 0, raise_by], 0)
    still = _run([rest.points], rest=rest)
    inside = Polylines(np.array([[5.0, 6, 1], [7, 6, 2]]), np.array([0, 2]))
    found = _values(_run([raised], rest=rest), still, MeasurementContext.of(still, inside, ()))
    area = 2 * 12**2 + 4 * 12 * height
    top, inner = area / 2, 10 * 10 + 4 * (1 * 10) / 2 + 2 / 3 + 2 / 6
    share = (top + inner) / (2 * area)
    assert_allclose(found["surface_deviation.distance_mean"], raise_by * share, rtol=1e-12)
    assert_allclose(found["surface_deviation.distance_rms"], raise_by * np.sqrt(share), rtol=1e-12)
    # Without weights the share is that of the vertices: 16 and 4 of twice 32.
    assert np.sqrt(20 / 64 / share) < 0.9


@pytest.mark.parametrize("interior", [True, False])
@pytest.mark.parametrize("factor", [0.8, 1.25])
def test_a_stretch_of_everything_stretches_every_fibre(factor: float, interior: bool) -> None:
    still = _run([SPHERE.points], [FIBRES.points])
    run = _run([_scaled(SPHERE.points, factor)], [_scaled(FIBRES.points, factor)] if interior else None)
    found = _values(run, still, MeasurementContext.of(still, FIBRES, ()))
    lengths, change = FIBRES.lengths(), factor - 1
    assert_allclose(found["fibre_length.max_percent"], 100 * abs(change), rtol=1e-10)
    assert_allclose(found["fibre_length.rms_percent"], 100 * abs(change), rtol=1e-10)
    assert_allclose(found["fibre_length.mean"], change * lengths.mean(), rtol=1e-10)
    assert_allclose(found["fibre_length.rms"], abs(change) * np.sqrt(np.mean(lengths**2)), rtol=1e-10)
    assert_allclose(found["fibre_length.max"], abs(change) * lengths.max(), rtol=1e-10)


@pytest.mark.parametrize("interior", [True, False])
def test_percent_of_a_fibre_is_of_its_length_at_rest(interior: bool) -> None:
    """20 % longer against 50 % longer is 30 % of the rest length shorter: not 20 % of the reference's, nor 25 % of the run's."""
    run, reference = (
        _run([_scaled(SPHERE.points, factor)], [_scaled(FIBRES.points, factor)] if interior else None)
        for factor in (1.2, 1.5)
    )
    found = _values(run, reference, MeasurementContext.of(reference, FIBRES, ()))
    assert_allclose(found["fibre_length.mean_percent"], -30, rtol=1e-10)
    for statistic in ("rms_percent", "max_percent"):
        assert_allclose(found[f"fibre_length.{statistic}"], 30, rtol=1e-10)


def test_a_run_without_fibres_is_compared_like_with_like() -> None:
    """The reference's fibres are not where its surface carries them; a run of the same surface deviates by 0."""
    surface_only = replace(REFERENCE, fibres=None, fibre_positions=None)
    assert extension_error(REFERENCE, CONTEXT).values[1] > 0.01
    assert _values(surface_only, REFERENCE, CONTEXT)["fibre_length.max"][1] == 0
    others = Polylines(FIBRES.points + 1.0, FIBRES.offsets)
    elsewhere = replace(REFERENCE, fibres=others, fibre_positions=REFERENCE.fibre_positions + 1.0)
    assert _values(elsewhere, REFERENCE, CONTEXT)["fibre_length.max"][1] == 0


def test_the_extension_error_is_surface_against_inside() -> None:
    still, affine = SPHERE.points, _scaled(SPHERE.points, 1.2)
    run = _run([still, affine, still], [FIBRES.points, _scaled(FIBRES.points, 1.2), _scaled(FIBRES.points, 1.1)])
    found = extension_error(run, MeasurementContext.of(run, FIBRES, ()))
    # Still and affine: exact. Fibres a tenth longer in a surface at rest: a tenth of the longest, which is fibre 2.
    assert_allclose(found.values, [0, 0, 0.1 * FIBRES.lengths().max()], rtol=1e-10, atol=1e-10)
    assert (found.metric, found.statistic, found.unit) == ("fibre_length", "extension_error", "mm")
    assert found.where[2] == "fibre 2"
    bare = replace(run, fibres=None, fibre_positions=None)
    assert np.isnan(extension_error(bare, MeasurementContext.of(bare, FIBRES, ())).values).all()


def test_rest_carries_the_fibres() -> None:
    """Fibres a tenth longer in a surface at rest: measured against rest directly, not through the surface."""
    run = _run([SPHERE.points, SPHERE.points], [FIBRES.points, _scaled(FIBRES.points, 1.1)])
    found = _values(run, at_rest(run), MeasurementContext.of(run, FIBRES, ()))
    assert_allclose(found["fibre_length.max_percent"], [0, 10], rtol=1e-10, atol=1e-12)
    bare = at_rest(_run([SPHERE.points]))
    assert bare.fibre_positions is None


def test_a_change_is_that_of_the_fibres_inside_a_run_wherever_they_begin() -> None:
    run = _run([SPHERE.points, SPHERE.points], [FIBRES.points, _scaled(FIBRES.points, 1.1)])
    apart = np.array([0, 0, 0.1])  # [mm], as where overlaps with bones are removed first
    elsewhere = replace(
        run, fibres=Polylines(FIBRES.points + apart, FIBRES.offsets), fibre_positions=run.fibre_positions + apart
    )
    for one in (run, elsewhere):
        assert_allclose(_find(change(one, CONTEXT), "fibre_length.max_percent").values, [0, 10], rtol=1e-10, atol=1e-10)
    bare = replace(run, fibres=None, fibre_positions=None)
    assert_allclose(_find(change(bare, CONTEXT), "fibre_length.max_percent").values, [0, 0], atol=1e-10)


def test_where_names_the_worst() -> None:
    moved = SPHERE.points.copy()
    moved[123] += 2 * (moved[123] - CENTRE) / RADIUS
    fibres = FIBRES.points.copy()
    fibres[12:24] = _scaled(FIBRES.points, 1.5)[12:24]
    still = _run([SPHERE.points], [FIBRES.points])
    measures = measure(_run([moved], [fibres]), still, MeasurementContext.of(still, FIBRES, ()))
    x, y, z = SPHERE.points[123]
    place = f"vertex 123 at ({x:.1f}, {y:.1f}, {z:.1f}) mm"
    assert _find(measures, "surface_deviation.max").where == (place,)
    assert _find(measures, "surface_deviation.hausdorff").where == (place,)
    assert _find(measures, "fibre_length.max").where == ("fibre 1",)
    assert _find(measures, "volume.deviation").where == ("",)


@pytest.mark.parametrize("interior", [True, False])
def test_moving_everything_rigidly_changes_nothing(interior: bool) -> None:
    turn = Rotation.random(rng=np.random.default_rng(5))

    def moved(points: np.ndarray) -> np.ndarray:
        return (turn.apply(points.reshape(-1, 3)) + np.array([30, -70, 20])).reshape(points.shape)

    def moved_run(run: Run, rest: Surface, fibres: Polylines) -> Run:
        inside = None if run.fibre_positions is None else moved(run.fibre_positions)
        lines = None if run.fibres is None else fibres
        return replace(run, surface=rest, positions=moved(run.positions), fibres=lines, fibre_positions=inside)

    rest, fibres = SPHERE.moved_to(moved(SPHERE.points)), Polylines(moved(FIBRES.points), FIBRES.offsets)
    run = _run([_scaled(SPHERE.points, 0.95)] * 2, [_scaled(FIBRES.points, 0.95)] * 2 if interior else None)
    reference = moved_run(REFERENCE, rest, fibres)
    before = _values(run, REFERENCE, CONTEXT)
    after = _values(moved_run(run, rest, fibres), reference, MeasurementContext.of(reference, fibres, ()))
    for name, values in before.items():
        assert_allclose(after[name], values, rtol=1e-9, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e200])
@pytest.mark.parametrize("interior", [True, False])
def test_what_is_not_a_number_never_passes(bad: float, interior: bool) -> None:
    positions, inside = REFERENCE.positions.copy(), REFERENCE.fibre_positions.copy()
    positions[1, 17], inside[1, 30] = bad, bad
    run = replace(REFERENCE, positions=positions, fibre_positions=inside if interior else None)
    for each in measure(run, REFERENCE, CONTEXT):
        name = f"{each.metric}.{each.statistic}"
        assert np.abs(each.values[0]) < 1e-12, name
        assert judge(float(each.values[1]), 0.0, 1e6) == "fail", name
        if np.isnan(bad):
            assert np.isnan(each.values[1]), name
            assert each.worst.frame == run.numbers[1]
    assert "vertex 17 at" in _find(measure(run, REFERENCE, CONTEXT), "surface_deviation.max").where[1]


def test_of_a_run_of_lines_alone_only_fibres_are_measured() -> None:
    """Not even as not-a-number: nothing that it never gave is missed. Its lengths are its own, at rest as well."""
    lines = _run([np.full_like(SPHERE.points, np.nan)] * 2, [_scaled(FIBRES.points, 0.9), _scaled(FIBRES.points, 1.1)])
    lines, still = replace(lines, has_surface=False), _run([SPHERE.points] * 2, [FIBRES.points] * 2)
    for other in (still, at_rest(lines)):
        found = _values(lines, other, CONTEXT)
        assert set(found) == {f"fibre_length.{name}" for name in UNITS["fibre_length"]}
        assert_allclose(found["fibre_length.mean_percent"], [-10, 10], rtol=1e-10)
    assert measure(lines, still, CONTEXT, ["volume"]) == ()
    # A reference that begins a little off the rest state, as overlaps with bones are removed first, has the same fibres.
    relaxed = replace(CONTEXT, fibres=Polylines(FIBRES.points + [0, 0, 0.2], FIBRES.offsets))
    moved = replace(still, fibres=relaxed.fibres)
    assert_allclose(_values(lines, moved, relaxed)["fibre_length.mean_percent"], [-10, 10], rtol=1e-10)
