"""Scalar cases: their meshes, what is read, what is fixed where, and that what is not usable is named."""

import json

import fields
import numpy as np
import octave_points
import pytest
import shapes

from fem_reference import cli
from fem_reference.foundations.errors import InputError
from fem_reference.io import files
from fem_reference.problems.scalar import build, mesh_of, numbers, whole_numbers
from fem_reference.scenes import casefile
from fem_reference.solvers import listing

DIFFUSION = {"name": "diffusion", "coefficient": 1.0}
REACTION = {"name": "reaction", "rate": 1.0}
INTERVAL = {"interval": {"start": 0.0, "end": 1.0, "count": 5}}
ENDS = [{"on": "left", "value": 0}, {"on": "right", "value": "x + 1"}]


def scene(folder, **tables):
    return fields.scene(folder, **({"domain": INTERVAL, "effect": [DIFFUSION], "boundary": ENDS} | tables))


def test_what_is_prescribed_on_ends_and_rims(tmp_path) -> None:
    fixed = build(scene(tmp_path)).fixed
    assert fixed == pytest.approx([0, np.nan, np.nan, np.nan, 2], nan_ok=True)
    for order in (1, 2):
        plate = scene(
            tmp_path,
            domain=fields.square(tmp_path, 4),
            boundary=[{"on": "rim", "where": "x - 0.999", "value": "y"}],
            element=fields.element(order),
        )
        problem = build(plate, 1)
        nodes = problem.mesh.nodes[order]
        expected = np.where(nodes[:, 0] == 1, nodes[:, 1], np.nan)
        assert problem.fixed == pytest.approx(expected, nan_ok=True)


def test_bounds_go_along_the_rim_when_the_mesh_is_refined(tmp_path) -> None:
    domain = fields.square(tmp_path, 3)
    points = build(scene(tmp_path, domain=domain, boundary=[{"on": "rim", "value": 0}])).mesh.points
    right = np.flatnonzero(points[:, 0] == 1)
    rows = [",".join(str(vertex + 1) for vertex in right), ",".join(f"{points[vertex, 1]:.17g}" for vertex in right)]
    (tmp_path / "bounds.csv").write_text("\n".join(rows) + "\n")
    problem = build(scene(tmp_path, domain=domain, boundary=[{"bounds": "bounds.csv"}], element=fields.element(2)), 2)
    nodes = problem.mesh.nodes[2]
    assert problem.fixed == pytest.approx(np.where(nodes[:, 0] == 1, nodes[:, 1], np.nan), nan_ok=True)


def test_the_shipped_plates_are_the_report_s() -> None:
    # Listing 4.3 on the square of listing 4.5, and eq. 4.11; Octave's linspace and cosine round otherwise in the last place.
    square, bounds = octave_points.square()
    problem = build(casefile.read("plate_square"))
    assert problem.mesh.points == pytest.approx(square, abs=1e-15)
    assert np.flatnonzero(~np.isnan(problem.fixed)).tolist() == sorted(bounds[0].astype(int).tolist())
    problem = build(casefile.read("plate_spiral"))
    assert problem.mesh.points == pytest.approx(octave_points.spiral(400), abs=1e-13)
    assert np.flatnonzero(~np.isnan(problem.fixed)).tolist() == octave_points.rim(problem.mesh.cells).tolist()


@pytest.mark.parametrize(
    ("tables", "match"),
    [
        ({"effect": [{"name": "reaction", "rate": 1.0}]}, r"effect: got no diffusion"),
        (
            {"effect": [DIFFUSION, {"name": "advection", "velocity": [1.0, 2.0]}]},
            r"effect\[1\]\.velocity: got 2 components, want 1",
        ),
        (
            {"effect": [DIFFUSION, {"name": "source", "strength": "y", "where": "everywhere"}]},
            r'strength: got "y", want a formula of x',
        ),
        ({"effect": [DIFFUSION, {"name": "source", "strength": "1/0", "where": "everywhere"}]}, r'strength: got "1/0"'),
        (
            {"effect": [DIFFUSION, {"name": "source", "strength": 1, "where": "y above average"}]},
            r"where: got .* on an interval",
        ),
        ({"boundary": []}, r"boundary: got no prescribed value and no reaction"),
        ({"boundary": [{"on": "rim", "value": 0}]}, r'boundary\[0\]\.on: got "rim", which has no facets'),
        (
            {"boundary": [{"on": "left", "value": "1/x"}]},
            r'boundary\[0\]\.value: got "1/x", which has no finite value at \(0\)',
        ),
        (
            {"boundary": [{"on": "left", "value": 1}, {"on": "left", "value": 0}]},
            r"boundary\[1\]\.value: got 0 where .* has 1",
        ),
        ({"exact": "z"}, r'exact: got "z"'),
        ({"exact": "(x-2)**0.5"}, r'exact: got "\(x-2\)\*\*0\.5", which has no finite value'),
        ({"boundary": [*ENDS[:1], {"on": "right", "where": "z", "slope": 0}]}, r'boundary\[1\]\.where: got "z"'),
        (
            {"boundary": [*ENDS[:1], *2 * [{"on": "right", "slope": 0}]]},
            r"boundary\[2\]\.slope: got a facet that already has a slope",
        ),
    ],
)
def test_scenes_that_are_not_usable(tmp_path, tables, match) -> None:
    with pytest.raises(InputError, match=match):
        build(scene(tmp_path, **tables))


@pytest.mark.parametrize(
    ("name", "text", "match"),
    [
        ("points.csv", "0,0\n1,0\n0\n", "points.csv: got 1 numbers in row 3, want 2 as in row 1"),
        ("points.csv", "0,0\n1,0\n0,nan\n", "points.csv: got .*, want rows of finite numbers"),
        ("points.csv", "0,0\n1,0\n0,a\n", "points.csv: got could not convert string to float: 'a', want numbers"),
        ("points.csv", "0\n1\n2\n", "points.csv: got rows of 1 numbers"),
        ("triangles.csv", "1,2\n", "triangles.csv: got rows of 2 numbers"),
        ("triangles.csv", "1,2,2.5\n", "triangles.csv: got the vertex 2.5"),
        ("triangles.csv", "1,2,4\n", "got a cell with a vertex outside 1 to 3"),
        ("bounds.csv", "1,2\n", "bounds.csv: got 1 rows"),
        ("bounds.csv", "1,4\n0,0\n", "bounds.csv: got vertices 1 to 4, want 1 to 3"),
        ("more.csv", "1\n2\n", "more.csv: got values that differ from another file of bounds"),
        ("bounds.csv", "1,1\n0,1\n", "bounds.csv: got a vertex named twice"),
    ],
)
def test_tables_that_are_not_usable(tmp_path, name, text, match) -> None:
    domain = fields.mesh(tmp_path, np.array([[0.0, 0], [1, 0], [0, 1]]), np.array([[0, 1, 2]]))
    (tmp_path / "bounds.csv").write_text("1\n0\n")
    (tmp_path / "more.csv").write_text("1\n0\n")
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=match):
        build(scene(tmp_path, domain=domain, boundary=[{"bounds": "bounds.csv"}, {"bounds": "more.csv"}]))


def test_the_listings_refuse_what_they_do_not_have(tmp_path) -> None:
    (offer,) = listing.SOLVES
    with pytest.raises(InputError, match="value 0 on the left and slope -1 on the right"):
        offer.run(build(scene(tmp_path)), listing.ListingSettings())
    plate = build(scene(tmp_path, domain=fields.square(tmp_path, 4), boundary=[{"on": "rim", "value": 0}]))
    sloped = scene(
        tmp_path, domain=fields.square(tmp_path, 4), boundary=[{"on": "rim", "slope": 0}], effect=[DIFFUSION, REACTION]
    )
    with pytest.raises(InputError, match=r"listing 4\.5 has no slopes"):
        offer.run(build(sloped), listing.ListingSettings())
    with pytest.raises(InputError, match=r"listing 4\.5 has none"):
        offer.run(plate, listing.ListingSettings(peclet=1.0))


def spoken(capsys, *arguments: str) -> tuple[int, str, str]:
    status = cli.main(list(arguments))
    out, err = capsys.readouterr()
    return status, out, err


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        (["run", "rod", "--solver", "pbd"], 'got "pbd", which does not solve scalar fields'),
        (["run", "hip_flexion", "--solver", "listing"], 'got "listing", which does not solve muscles'),
        (["run", "rod", "--set", "peclet"], '--set: got "peclet", want KEY=VALUE'),
        (
            ["compare", "rod", "--candidate", "listing", "--set", "candidate[1].speed=2"],
            "candidate[1].speed: got an unknown key, want",
        ),
        (
            ["run", "rod", "--set", "expect[0].metric=beauty"],
            'expect[0]: metric and statistic: got "beauty", want one of',
        ),
        (["run", "rod", "--set", "expect[0].of=nobody"], 'expect[0].of: got "nobody", want one of reference'),
        (["run", "rod", "--set", "effect[0].name=neo_hooke"], 'got "neo_hooke", want one of advection, diffusion'),
        (["run", "hip_flexion", "--set", "effect[0].name=diffusion"], 'got "diffusion", want one of active_tension'),
        (
            ["compare", "rod", "--candidate", "magic"],
            '--candidate: got "magic", want a folder of frames, a solver, or one of fenicsx',
        ),
    ],
)
def test_what_the_command_line_refuses(tmp_path, capsys, arguments, match) -> None:
    status, _, err = spoken(capsys, *arguments, "--out", str(tmp_path / "out"), "--quiet")
    assert status == cli.BAD_INPUT
    assert match in err
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_peclet_is_a_parameter_of_the_rod(tmp_path, capsys) -> None:
    # At 10 the listing solves 10 psi'' = 1/10, 10 psi'(1) = -1: psi(1) = 1/200 - 1/10 - 1/100 = -0.105.
    arguments = ["run", "rod", "--solver", "listing", "--out", str(tmp_path), "--quiet"]
    status, out, _ = spoken(capsys, *arguments, "--set", "candidate[1].peclet=10")
    assert status == cli.VERDICT_FAIL
    assert "listing minimum: -0.105\n" in out
    for domain in ("{nodes=[0.0, 0.3, 1.0]}", "{interval={start=0.0, end=1.0, count=20}}"):  # given, and evenly spaced
        status, out, _ = spoken(capsys, *arguments, "--set", f"domain={domain}")
        assert status == cli.DONE
    status, out, _ = spoken(capsys, "list", "--out", str(tmp_path))
    assert "runs/listing-" in out


def test_show_reports_what_a_scalar_case_is_made_of(capsys) -> None:
    status, out, _ = spoken(capsys, "show", "rod_advection")
    assert status == cli.DONE
    assert "form: supg, mesh Peclet number up to 2.5" in out
    assert "Advection:" in out


RESONATES = """
title = "t"
proves = "p"
[domain]
nodes = [0.0, 1.0, 2.0, 3.0]
[[effect]]
name = "diffusion"
coefficient = 1.0
[[effect]]
name = "reaction"
rate = -1.2
[[boundary]]
on = "left"
value = 0
[[boundary]]
on = "right"
value = 0
[element]
order = 1
form = "auto"
[reference]
solver = "scikit_fem"
[[candidate]]
name = "fenicsx"
solver = "scikit_fem"
form = "galerkin"
[[expect]]
of = "reference"
metric = "maximum"
truth = 0.0
within = 1.0
kind = "property"
because = "it cannot be"
[negative_control]
key = "boundary[0].value"
value = 2.0
because = "what is fixed is another value"
"""


def test_a_reference_that_fails_is_reported_in_full(tmp_path, capsys) -> None:
    # Three elements of length 1 resonate at -6 / 5: no solution, which is a status and never a pass.
    (tmp_path / "case.toml").write_text(RESONATES)
    target = tmp_path / "facts.json"
    status, out, _ = spoken(
        capsys, "compare", str(tmp_path), "--out", str(tmp_path / "out"), "--json", str(target), "--quiet"
    )
    assert status == cli.SOLVER_FAILED
    assert "no unique solution" in out
    assert "fail: reference maximum is not a number" in out
    assert (tmp_path / "out" / tmp_path.name / "report.html").is_file()
    assert '"diverged"' in target.read_text()


def test_a_candidate_can_be_run_by_its_name(tmp_path, capsys) -> None:
    status, out, _ = spoken(
        capsys, "run", "rod_advection", "--solver", "plain_galerkin", "--out", str(tmp_path), "--quiet"
    )
    assert status == cli.DONE
    assert "pass: plain_galerkin minimum is -0.428571" in out
    (stored,) = (tmp_path / "runs").glob("scikit_fem-*/run.json")
    assert json.loads(stored.read_text())["origin"]["form"] == "galerkin", (
        "what was solved, and not what the scene asks for"
    )


EVEN = {"start": 0.0, "end": 1.0, "count": 5}


def case_on(folder, domain):
    """A scene of diffusion on ``domain``."""
    return fields.scene(folder, domain=domain, effect=[{"name": "diffusion", "coefficient": 1.0}])


def test_nodes_at_random_are_those_of_the_seed(tmp_path) -> None:
    drawn = [case_on(tmp_path, {"interval": EVEN | {"seed": seed}}) for seed in (1, 1, 2)]
    one, again, other = (mesh_of(entry).points[:, 0] for entry in drawn)
    assert (one == again).all()
    assert (one != other).any()
    assert (one[0], one[-1], len(one)) == (0, 1, 5)
    assert (np.diff(one) > 0).all()


@pytest.mark.parametrize(
    ("points", "match"),
    [
        ("0,0\n1,1\n2,2\n", "points that cannot be triangulated"),
        ("0,0,0\n1,0,0\n0,1,0\n", '"delaunay" of points in space'),
    ],
)
def test_points_that_delaunay_cannot_do(tmp_path, points, match) -> None:
    (tmp_path / "points.csv").write_text(points)
    domain = {"mesh": {"points": "points.csv", "triangles": "delaunay"}}
    with pytest.raises(InputError, match=match):
        mesh_of(case_on(tmp_path, domain))


def test_an_interval_is_divided_evenly_and_nodes_are_as_given(tmp_path) -> None:
    even = mesh_of(case_on(tmp_path, {"interval": {"start": -1.0, "end": 2.0, "count": 4}}))
    assert even.points[:, 0].tolist() == [-1, 0, 1, 2]
    given = mesh_of(case_on(tmp_path, {"nodes": [0.0, 0.25, 2.0]}))
    assert given.points[:, 0].tolist() == [0, 0.25, 2]
    assert given.cells.tolist() == [[0, 1], [1, 2]]
    assert given.sizes == pytest.approx([0.25, 1.75])


def test_a_square_has_its_area_by_its_triangles_and_by_those_of_delaunay(tmp_path) -> None:
    domain = fields.square(tmp_path, 5)
    made = domain["mesh"] | {"triangles": "delaunay"}
    one, other = (mesh_of(case_on(tmp_path, entry)) for entry in (domain, {"mesh": made}))
    assert one.sizes.sum() == pytest.approx(1, abs=1e-12)
    # The same points, and as many triangles: an edge may be turned where four points are on a circle.
    assert np.array_equal(one.points, other.points)
    assert len(one.cells) == len(other.cells) == 2 * 4 * 4
    assert other.sizes.sum() == pytest.approx(1, abs=1e-12)


def test_a_surface_in_a_file_is_scaled_to_millimetres(tmp_path) -> None:
    ball = shapes.sphere(2)
    files.write_surface(tmp_path / "ball.vtp", ball, ball.points)
    sizes = [
        mesh_of(case_on(tmp_path, {"surface": {"file": "ball.vtp", "scale": scale}})).sizes.sum()
        for scale in (1.0, 10.0)
    ]
    assert sizes[1] == pytest.approx(100 * sizes[0])
    assert sizes[0] == pytest.approx(4 * np.pi, rel=0.05)


def test_a_table_is_of_finite_numbers_and_whole_where_it_counts(tmp_path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("1,2.5\n-3,4\n")
    assert numbers(path).tolist() == [[1, 2.5], [-3, 4]]
    with pytest.raises(InputError, match=r"the vertex 2\.5"):
        whole_numbers(path, numbers(path))
    found = whole_numbers(path, np.array([[1.0, 2], [-3, 4]]))
    assert found.dtype == np.int64
    assert found.tolist() == [[1, 2], [-3, 4]]
    for text, want in (("1\n1,2\n", "1 as in row 1"), ("inf\n", "rows of finite numbers"), ("a\n", "numbers")):
        path.write_text(text)
        with pytest.raises(InputError, match=f"want {want}"):
            numbers(path)
