"""The report shows all of a comparison and opens without a network."""

import csv
import io
import json
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fem_reference import report
from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.error_bars import ErrorBar, ErrorBars
from fem_reference.assessment.judge import Verdict
from fem_reference.foundations.errors import MissingSoftware
from fem_reference.foundations.mesh import Polylines, Surface
from fem_reference.foundations.motion import Translation
from fem_reference.geometry.rigid_bodies import HalfSpace
from fem_reference.geometry.tessellation import tessellated
from fem_reference.metrics import Measure, MeasurementContext
from fem_reference.problems.setup import RigidBody, Setup
from fem_reference.report import gallery, page
from fem_reference.report import sections as folder_of_sections
from fem_reference.report.at_frames import label
from fem_reference.report.curves import _surface_limits, curves
from fem_reference.report.sections import sections
from fem_reference.report.sections.reference import least
from fem_reference.report.tables import COLUMNS
from fem_reference.report.words import duration, number
from fem_reference.runs.cost import seconds_per_frame
from fem_reference.runs.store import Outcome, Run
from fem_reference.scenes import casefile

NUMBERS = (0, 10, 20, 30, 40)
NAN = float("nan")
CASE = """
title = "A ball that is pressed"
proves = "The page says what was measured."
[muscle]
surface = "ball.txt"
unit = "mm"
tet_size = "2 mm"
[[bone]]
name = "plate"
surface = "plate.txt"
unit = "mm"
[bone.motion]
axis = [0, 0, 1]
centre = "0, 0, 0 mm"
keyframes = [{frame = 0, angle = "0 rad"}, {frame = 40, angle = "1 rad"}]
[[attachment]]
name = "foot"
bone = "plate"
within = "1 mm"
[[effect]]
name = "neo_hooke"
mu = "10 kPa"
[fibres]
traced = {count = 2, start = "foot", end = "foot"}
[frames]
first = 0
last = 40
every = 10
[reference]
solver = "fenicsx"
[[expect]]
of = "reference"
metric = "volume"
statistic = "deviation"
frame = "any"
truth = "0 %"
within = "0.5 %"
kind = "property"
because = "It is <nearly> incompressible & closed."
[negative_control]
key = "effect[0].mu"
value = "1 kPa"
because = "softer"
"""


def ball() -> Surface:
    """A closed surface of 66 points with half axes 30, 20, 10 along x, y, z [mm]."""
    corners = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    triangles = np.array([[i, (i + 1) % 4, 4] for i in range(4)] + [[(i + 1) % 4, i, 5] for i in range(4)])
    points = [tuple(corner) for corner in corners]
    for _ in range(2):
        finer = []
        for triangle in triangles:
            middles = []
            for i, j in ((0, 1), (1, 2), (2, 0)):
                middle = np.add(points[triangle[i]], points[triangle[j]])
                middle = tuple(np.round(middle / np.linalg.norm(middle), 12))
                if middle not in points:
                    points.append(middle)
                middles.append(points.index(middle))
            (a, b, c), (d, e, f) = triangle, middles
            finer += [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
        triangles = np.array(finer)
    return Surface(np.array(points) * [30, 20, 10], triangles)


def measured(run: Run, other: np.ndarray) -> tuple[Measure, ...]:
    """Measures in the manner of the metrics, made by hand so that these tests stand alone."""
    distances = np.linalg.norm(run.positions - other, axis=2)
    where = tuple(f"vertex {i}" for i in np.argmax(np.nan_to_num(distances), axis=1))
    return (
        Measure("volume", "deviation", "%", distances.mean(axis=1) / 7),
        Measure("volume", "deviation_volume", "mm3", distances.mean(axis=1) * 700),
        Measure("fibre_length", "mean", "mm", -distances.mean(axis=1)),
        Measure("fibre_length", "max", "mm", distances.mean(axis=1) * 2, where),
        Measure("surface_deviation", "rms", "mm", np.sqrt((distances**2).mean(axis=1))),
        Measure("surface_deviation", "p95", "mm", np.quantile(distances, 0.95, axis=1)),
        Measure("surface_deviation", "max", "mm", distances.max(axis=1), where),
        Measure("surface_deviation", "hausdorff", "mm", distances.max(axis=1) / 2, where),
    )


def a_run(name: str, solver: str, positions: np.ndarray, status: str = "converged", **more) -> Run:
    cost = {"seconds": 12.0, "seconds_solve": 8.0, "iterations": 40}
    return Run(name, solver, Outcome(status, f"{name} has ended", cost), NUMBERS, ball(), positions, **more)


@pytest.fixture
def comparison(tmp_path, monkeypatch) -> Comparison:
    """What most tests here are about."""
    return small_comparison(tmp_path, monkeypatch)


def small_comparison(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Comparison:
    """A reference that moves along x, ``quick`` 1 mm a frame beside it, ``torn`` whose last frame is not a number."""
    monkeypatch.setattr(gallery, "_command", lambda _job, _folder: [sys.executable, "-c", "raise SystemExit(3)"])
    (tmp_path / "press").mkdir()
    for name, text in (("case.toml", CASE), ("ball.txt", "ball"), ("plate.txt", "plate")):
        (tmp_path / "press" / name).write_text(text)
    scene = casefile.read(tmp_path / "press")
    rest, steps = ball(), np.arange(5.0)[:, None, None]
    moved = rest.points + steps * [2.0, 0, 0]
    torn = moved + steps * [0, 0.5, 0]
    torn[-1, 7] = NAN
    origin = {"versions": {"dolfinx": "0.11.0"}, "mesh": {"tets": 234.0}}
    reference = a_run(
        "reference", "fenicsx", moved, scalars={"min_det_F_points": 1 - steps[:, 0, 0] / 8}, origin=origin
    )
    quick, torn = a_run("quick", "pbd", moved + steps * [0, 0, 1.0]), a_run("torn", "recorded", torn, "diverged")
    plate = RigidBody("plate", Surface(rest.points - [0, 0, 25], rest.triangles), scene.bone[0].motion.poses())
    return Comparison(
        scene=scene,
        setup=Setup(rest, (plate,), (), NUMBERS, None),
        reference=reference,
        candidates=(quick, torn),
        context=MeasurementContext.of(
            reference, Polylines([[0, 0, 0], [5, 0, 0], [0, 1, 0], [5, 1, 0]], [0, 2, 4]), ()
        ),
        deviations={run.name: measured(run, moved) for run in (quick, torn)},
        changes={run.name: measured(run, rest.points) for run in (reference, quick, torn)},
        extension_error=Measure("fibre_length", "extension_error", "mm", np.arange(5) / 8, ("fibre 1",) * 5),
        verdicts=(Verdict("pass", scene.expect[0], 0.25, 0.0, 0.5, "%", 20),),
    )


def alone(comparison: Comparison) -> Comparison:
    return replace(comparison, candidates=(), deviations={}, changes={"reference": comparison.changes["reference"]})


def test_summary_has_the_documented_keys_and_survives_json(comparison):
    printed = report.summary(comparison)
    assert json.loads(json.dumps(printed, allow_nan=False)) == printed
    keys = [
        "case",
        "solver",
        "status",
        "message",
        "verdict",
        "doubts",
        "second_check",
        "cost",
        "measures",
        "from_rest",
        "verdicts",
        "error_bars",
        "rankings",
    ]
    assert list(printed) == keys
    assert printed["error_bars"] == []
    assert (printed["case"], printed["solver"], printed["status"], printed["verdict"]) == (
        "press",
        "fenicsx",
        "converged",
        "pass",
    )
    assert printed["cost"]["quick"] == {"seconds": 12.0, "seconds_solve": 8.0, "iterations": 40.0}
    assert {row["candidate"] for row in printed["from_rest"]} == {"reference", "quick", "torn"}
    assert printed["verdicts"][0]["because"] == "It is <nearly> incompressible & closed."


def value(rows, candidate, metric, statistic, frame):
    (found,) = (
        row["value"]
        for row in rows
        if (row["candidate"], row["metric"], row["statistic"], row["frame"]) == (candidate, metric, statistic, frame)
    )
    return found


def test_summary_values_are_the_measures(comparison):
    printed = report.summary(comparison)
    # quick is 1 mm a step from the reference, and sqrt(1 + 2^2) mm a step from rest; rounding is 1e-15.
    assert value(printed["measures"], "quick", "surface_deviation", "max", 30) == pytest.approx(3, abs=1e-12)
    assert value(printed["from_rest"], "quick", "surface_deviation", "max", 30) == pytest.approx(3 * 5**0.5, abs=1e-12)
    assert value(printed["measures"], "reference", "surface_deviation", "max", 30) == pytest.approx(6, abs=1e-12)
    assert value(printed["measures"], "reference", "inversion", "min_det_F_points", 40) == 0.5


def test_what_is_not_finite_is_null(comparison):
    printed = report.summary(comparison)
    assert value(printed["measures"], "torn", "surface_deviation", "rms", 40) is None
    assert value(printed["measures"], "torn", "surface_deviation", "rms", 30) == pytest.approx(1.5, abs=1e-12)
    damaged = replace(comparison.verdicts[0], word="fail", value=float("inf"))
    assert report.summary(replace(comparison, verdicts=(damaged,)))["verdicts"][0]["value"] is None


def test_csv_has_the_same_numbers(comparison, tmp_path):
    report.write(comparison, tmp_path / "out")
    rows = list(csv.DictReader(io.StringIO((tmp_path / "out" / "measures.csv").read_text())))
    printed = json.loads((tmp_path / "out" / "measures.json").read_text())["measures"]
    assert tuple(rows[0]) == COLUMNS
    read = [row | {"frame": int(row["frame"]), "value": float(row["value"]) if row["value"] else None} for row in rows]
    assert read == printed


def test_page_names_everything_and_needs_no_network(comparison, tmp_path):
    text = report.write(comparison, tmp_path / "new" / "out").read_text(encoding="utf-8")
    for printed in ("quick", "torn", "press", "torn has ended", "dolfinx", "<td>234</td>"):
        assert printed in text
    assert "0.500&#8239;" in text
    assert "It is &lt;nearly&gt; incompressible &amp; closed." in text
    assert '<span class="bad">not a number</span>' in text
    assert all(f"<td>{frame}</td>" in text for frame in NUMBERS)
    assert re.findall(r"<script.*?>", text) == [
        '<script type="application/json" id="page-facts">',
        '<script type="application/json" id="viewer-data">',
        '<script type="module">',
        "<script>",
    ]
    bare = re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL)
    links = re.findall(r'\b(?:src|href|action|data|srcset)\s*=\s*["\']?([^"\'\s>]*)', bare)
    assert all(link.startswith(("#", "data:")) for link in links)
    assert not re.search(r"<script|<link|<iframe|@import|url\((?!#)|http(?!-equiv)", bare)


def test_every_id_on_the_page_is_unique_and_every_reference_meets_one(comparison):
    text = page.render(comparison)
    ids = re.findall(r'\bid="([^"]*)"', text)
    assert len(ids) == len(set(ids))
    assert set(re.findall(r'(?:href="|url\()#([^")]*)', text)) <= set(ids)


def test_reference_without_candidates_has_the_same_page(comparison, tmp_path):
    text = report.write(alone(comparison), tmp_path).read_text(encoding="utf-8")
    assert "without a candidate" in text
    assert "quick" not in text
    assert {row["candidate"] for row in report.summary(alone(comparison))["measures"]} == {"reference"}


@pytest.mark.parametrize(
    ("command", "why"),
    [
        ([sys.executable, "-c", "raise SystemExit(3)"], "code 3"),
        ([sys.executable, "-c", "import os; os.abort()"], "code -6"),
        ([sys.executable, "-c", "pass"], "no pictures"),
        ([sys.executable, "-c", "import time; time.sleep(60)"], "timed out"),
        (["/nowhere/python"], "No such file"),
    ],
)
def test_page_without_pictures_says_what_to_install(comparison, monkeypatch, command, why):
    monkeypatch.setattr(gallery, "_command", lambda _job, _folder: command)
    monkeypatch.setattr(gallery, "_SECONDS", 2 if "60" in command[-1] else 60)
    with pytest.raises(MissingSoftware, match=f"{why}.*libegl1"):
        gallery.draw(comparison.setup, comparison.reference.surface, gallery.shots(comparison))
    if why == "code 3":
        assert "apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri" in page.render(comparison)


def test_nothing_is_written_when_the_page_cannot_be_made(comparison, tmp_path, monkeypatch):
    monkeypatch.setattr(page, "render", lambda _: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        report.write(comparison, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_shots_are_the_worst_frames_that_can_be_drawn(comparison):
    chosen = [(shot.name, shot.number) for shot in gallery.shots(comparison)]
    # The reference moves on to the end; the last frame of "torn" is not a number.
    assert chosen == [("reference", 0), ("reference", 40), ("quick", 40), ("torn", 30)]
    quick = gallery.shots(comparison)[2]
    np.testing.assert_allclose(quick.distances, 4.0, rtol=1e-12)
    np.testing.assert_array_equal(quick.outline, comparison.reference.positions[4])


def test_a_candidate_without_a_frame_to_draw_is_reported(comparison, monkeypatch):
    lost = a_run("torn", "recorded", np.full_like(comparison.reference.positions, np.inf), "diverged")
    changed = replace(comparison, candidates=(comparison.candidates[0], lost))
    monkeypatch.setattr(gallery, "draw", lambda _setup, _surface, wanted: [(b"1", b"2") for _ in wanted])
    assert [shot.name for shot in gallery.shots(changed)] == ["reference", "reference", "quick"]
    assert "<b>torn</b> has no frame whose coordinates are all numbers" in page.render(changed)


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_cameras_look_at_the_widest_side_away_from_the_bones(comparison, up):
    # Half axes 30, 20, 10: widest seen along z, a quarter turn about x on from there is y.
    rng = np.random.default_rng(3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    body = comparison.setup.surface
    bone = Surface((body.points + np.array([0, 12, -25 * up])) @ turn.T, body.triangles)
    views = gallery.directions(body.moved_to(body.points @ turn.T), (RigidBody("plate", bone, None),))
    # The body is symmetric, so only rounding is between its axes and the computed ones.
    np.testing.assert_allclose(views @ turn, [[0, 0, up], [0, -1, 0]], atol=1e-9)


def test_cameras_look_along_the_coordinates_where_two_axes_are_as_long(comparison):
    body = comparison.setup.surface
    points = body.points / [30, 20, 10] * [20, 8, 20] + np.random.default_rng(4).normal(size=body.points.shape) * 1e-12
    plate = RigidBody("plate", body.moved_to(body.points - [300, 200, 100]), None)
    np.testing.assert_allclose(gallery.directions(body.moved_to(points), (plate,)), [[0, 1, 0], [1, 0, 0]], atol=0.01)


def test_cameras_do_not_look_through_plates(comparison):
    # Half axes 30, 20, 10 again, now between plates across z: seen along y and x. With one plate alone, from its other side.
    body = comparison.setup.surface
    floor, lid = (HalfSpace((0, 0, -10 * up), (0, 0, up)) for up in (1, -1))
    bones = tuple(
        RigidBody("plate", tessellated(solid, body.points, "plate"), None, solid=solid) for solid in (floor, lid)
    )
    np.testing.assert_allclose(np.abs(gallery.directions(body, bones)), [[0, 1, 0], [1, 0, 0]], atol=1e-9)
    np.testing.assert_allclose(gallery.directions(body, bones[:1])[0], [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(gallery.directions(body, bones[1:])[0], [0, 0, -1], atol=1e-9)


@pytest.mark.slow
def test_pictures_show_the_candidate_in_the_colours_of_the_bar(comparison, monkeypatch):
    from PIL import Image

    monkeypatch.undo()
    try:
        drawn = gallery.draw(comparison.setup, comparison.reference.surface, gallery.shots(comparison)[2:3])
    except MissingSoftware as error:
        pytest.skip(str(error))
    for picture in drawn[0]:
        pixels = np.asarray(Image.open(io.BytesIO(picture)).convert("RGB")).astype(int)
        assert pixels.shape == (840, 840, 3)
        assert (pixels[0, 0] > 250).all()
        # Every vertex is 4 mm away, the top of the bar: yellow, so red and green are far above blue. The body fills at
        # least an ellipse of half axes 20 and 10 in a window of half side 1.06 * 34: 0.12 of the picture.
        yellow = (pixels[:, :, 0] > pixels[:, :, 2] + 80) & (pixels[:, :, 1] > pixels[:, :, 2] + 80)
        assert yellow.mean() > 0.1
        assert (pixels.max(axis=2) < 60).any()


def test_curves_show_where_a_run_is_not_a_number(comparison):
    drawn = {curve.title: curve.svg for curve in curves(comparison)}
    assert len(drawn) == 5
    assert "not a number" in drawn["Surface of torn: distance to the reference"]
    assert "not a number" not in drawn["Surface of quick: distance to the reference"]
    assert all(svg.startswith("<svg viewBox=") for svg in drawn.values())


def with_bars(comparison: Comparison) -> Comparison:
    """A tenth of each greatest value of "quick", not known in the last frame, of the reference and of deviations from it."""
    bars = [
        ErrorBar(of, one.metric, one.statistic, one.unit, known, {"tetrahedra": 0.5, "load steps": NAN}, 3 * known)
        for of in ("change", "deviation")
        for one in comparison.deviations["quick"]
        for known in [np.append(np.abs(one.values[:-1]) / 10, NAN)]
    ]
    return replace(comparison, error_bars=ErrorBars(NUMBERS, (2.0, 4.0), 1.5, tuple(bars)))


def test_how_well_the_reference_is_known_is_reported(comparison):
    assert "With <code>--error-bar</code> the reference is solved" in page.render(comparison)
    text = page.render(with_bars(comparison))
    assert "(4 mm instead of 2 mm)" in text
    assert "order 1.50 in general" in text
    names = ", ".join(attachment.name for attachment in comparison.scene.attachment)
    assert f"Along the rims of {names}, where" in text
    assert "By how much exact ones would change a statistic" in text
    assert "cause of error halved at a time (load steps)" in text
    assert "--error-bar" not in text
    # The worst frame of "quick" is the last, where the bar is not known; that of "torn" is the one before.
    assert '<small>± <span class="bad">not a number</span>' in text
    assert text.count("<th>exact attachments</th>") == 2
    rows = report.summary(with_bars(comparison))["error_bars"]
    found = [row for row in rows if (row["of"], row["metric"], row["statistic"]) == ("change", "volume", "deviation")]
    assert [row["value"] for row in found] == [
        0,
        pytest.approx(1 / 70),
        pytest.approx(2 / 70),
        pytest.approx(3 / 70),
        None,
    ]
    assert [row["frame"] for row in found] == list(comparison.reference.numbers)
    assert (found[1]["model"], found[1]["unit"]) == (pytest.approx(3 / 70), "%")


def test_candidates_are_ranked_where_the_reference_is_known(comparison):
    assert "Who is nearer to the truth" not in page.render(comparison)
    known = with_bars(comparison)
    assert "Who is nearer to the truth" in page.render(known)
    ranked = report.summary(known)["rankings"]
    assert {row["name"] for row in ranked} == {run.name for run in comparison.candidates}
    # "torn" has no number in its last frame: it comes last, whatever is known.
    assert [row["rank"] for row in ranked if row["by"] == "Surface, rms"] == [[1, 1], [2, 2]]


def test_curves_have_a_band_as_wide_as_the_error_bar(comparison):
    bare, banded = curves(comparison), curves(with_bars(comparison))
    printed = {curve.title: "error bar" in curve.svg for curve in banded}
    assert printed == {curve.title: not curve.title.startswith("Smallest det F") for curve in banded}
    assert not any("error bar" in curve.svg for curve in bare)


def lacking(comparison: Comparison) -> dict[str, Comparison]:
    """The comparison, and what it is without each of the things that sections may need."""
    whole = with_bars(comparison)
    return {
        "nothing": whole,
        "candidates": alone(whole),
        "verdicts": replace(whole, verdicts=()),
        "rankings": replace(whole, error_bars=None),
    }


def own_heading(name: str, text: str) -> bool:
    """Whether a page has a section, by its first heading as in its template."""
    template = (Path(folder_of_sections.__file__).parent / f"{name}.html").read_text(encoding="utf-8")
    heading = re.search(r"<section>\s*(<h[23][^>]*>[^<{]+</h[23]>)", template)
    assert heading, f"{name}.html does not begin with <section> and a heading"
    assert text.count(heading[1]) <= 1
    return heading[1] in text


@pytest.fixture(scope="module")
def rendered() -> dict[str, str]:
    """Pages that one test has rendered, for the others."""
    return {}


@pytest.mark.parametrize("name", sections())
def test_a_section_is_shown_where_its_numbers_exist_and_absent_where_they_do_not(comparison, name, rendered):
    """The contract of sections, met by every file of report/sections."""
    section = sections()[name]
    assert set(section.needs) <= lacking(comparison).keys(), "a new need: say above how a comparison lacks it"
    for without, one in lacking(comparison).items():
        text = rendered[without] = rendered.get(without) or page.render(one)
        assert own_heading(name, text) == section.has_numbers(one), without
        ids = re.findall(r'\bid="([^"]*)"', text)
        assert len(ids) == len(set(ids))
    assert section.has_numbers(with_bars(comparison))
    assert not any(section.has_numbers(lacking(comparison)[need]) for need in section.needs)


def test_sections_stand_in_their_order(comparison):
    text = page.render(with_bars(comparison))
    assert [text.count("<section>"), text.count("</section>")] == [len(sections())] * 2
    orders = [section.order for section in sections().values()]
    assert sorted(set(orders)) == orders


@pytest.mark.parametrize("text", ["", "SECTION = len"])
def test_a_file_that_is_no_section_is_named(text, tmp_path, monkeypatch):
    (tmp_path / "unfinished.py").write_text(text)
    monkeypatch.setattr(folder_of_sections, "__path__", [*folder_of_sections.__path__, str(tmp_path)])
    monkeypatch.setitem(sys.modules, f"{folder_of_sections.__name__}.unfinished", None)  # so that it is gone afterwards
    del sys.modules[f"{folder_of_sections.__name__}.unfinished"]
    with pytest.raises(TypeError, match=r"report/sections/unfinished: SECTION is .*, want a Section"):
        sections()


def test_a_scene_that_differs_from_its_file_is_reported(comparison):
    damaged = replace(comparison, scene=casefile.read(comparison.scene.place, with_negative_control=True))
    assert "effect[0].mu" not in re.sub(r"<pre>.*</pre>", "", page.render(comparison), flags=re.DOTALL)
    assert "<th>effect[0].mu</th><td>0.01 in the file, 0.001 here</td>" in page.render(damaged)


def test_a_reference_turned_inside_out_is_reported(comparison):
    assert "inside out. At" not in page.render(alone(comparison))
    scalars = {"min_det_F_points": np.array([1, 0.5, -0.25, 0.5, NAN])}
    turned = replace(alone(comparison), reference=replace(comparison.reference, scalars=scalars))
    assert re.search(r"at points falls to \N{MINUS SIGN}0.250: there the reference is turned", page.render(turned))


def test_a_reference_that_is_unstable_is_reported(comparison):
    def rendered(modes):
        scalars = {"negative_modes": np.array(modes)}
        return page.render(replace(alone(comparison), reference=replace(comparison.reference, scalars=scalars)))

    assert "unstable equilibrium" not in page.render(alone(comparison)) + rendered([0, 0, 0, NAN, 0])
    assert re.search(
        r"unstable equilibrium at 2 of . frames: its energy falls in\s+up to 3 dir", rendered([0, 1, 3, NAN, 0])
    )


def test_least_of_nothing_known_is_not_a_number():
    assert np.isnan(least(Measure("inversion", "min_det_F", "1", np.array([NAN, NAN]))))


def test_effects_are_reported_with_their_units(comparison):
    assert comparison.scene.effects[0].parameters == [("mu", 0.01, "MPa")]
    assert "<tr><th>NeoHooke</th><td>mu = 0.01 MPa</td></tr>" in page.render(comparison)


def test_time_per_frame_counts_the_frames_that_were_reached(comparison):
    torn = comparison.candidates[1]
    assert seconds_per_frame(comparison.candidates[0]) == 8.0 / 4
    assert seconds_per_frame(replace(torn, solver="pbd")) == 8.0 / 3
    assert seconds_per_frame(torn) is None


def test_numbers_as_people_read_them():
    minus, times, dash, thin = "\N{MINUS SIGN}", "\N{MULTIPLICATION SIGN}", "\N{EN DASH}", "\N{NARROW NO-BREAK SPACE}"
    assert number(-12.3456) == f"{minus}12.3"
    assert number(65021) == f"65{thin}021"
    assert number(-1.5e-14) == f"{minus}1.50 {times} 10\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT ONE}\N{SUPERSCRIPT FOUR}"
    assert [number(float("-inf")), number(None), duration(None)] == [f"{minus}infinite", dash, dash]


def test_candidates_share_one_colour_scale_and_one_axis(comparison):
    # quick is 4 mm away at its worst, torn 1.5 mm.
    wanted = gallery.shots(comparison)
    assert gallery.top(wanted) == pytest.approx(4.0)
    assert gallery.top(wanted[:1]) == 0
    assert _surface_limits(comparison) == (0.0, pytest.approx(1.04 * 4), False)
    far = comparison.deviations | {
        "torn": tuple(
            replace(one, values=1e4 * one.values)
            for one in measured(comparison.candidates[1], comparison.reference.positions)
        )
    }
    low, high, logarithmic = _surface_limits(replace(comparison, deviations=far))
    assert logarithmic
    assert (low, high) == (pytest.approx(4e-3), pytest.approx(1.3 * 1.5e4))
    assert _surface_limits(alone(comparison)) == (0.0, 1.04, False)


def test_a_frame_is_its_number_with_what_is_known_there(comparison):
    assert label(comparison.scene, comparison.setup, 20) == "frame 20 (plate 28.6°)"  # half of 1 rad
    text = page.render(comparison)
    assert "from frame 0 (plate 0°) to frame 40 (plate 57.3°)" in text
    assert '<th>Frame</th><th>plate <span class="unit">°</span></th>' in text
    frames = comparison.scene.frames.model_copy(update={"interval": 0.05})
    timed = comparison.scene.model_copy(update={"frames": frames})
    assert label(timed, comparison.setup, 20) == "frame 20 (time 1 s, plate 28.6°)"
    slid = replace(comparison.setup.bones[0], motion=Translation((1, 0, 0), (0, 40), (0.0, 8.0)))
    assert label(comparison.scene, replace(comparison.setup, bones=(slid,)), 10) == "frame 10 (plate 2 mm)"


def test_of_a_reference_that_failed_the_frames_that_it_reached_are_shown(comparison):
    positions = np.array(comparison.reference.positions)
    positions[3:] = NAN
    lost = Outcome("diverged", "no equilibrium near the foot; try smaller steps", {"seconds": 1.0})
    failed = replace(comparison.reference, positions=positions, outcome=lost)
    quick = replace(comparison.candidates[0], name="quick")
    deviations, changes = (
        {"quick": measured(quick, positions)},
        {"reference": measured(failed, ball().points), "quick": measured(quick, ball().points)},
    )
    one = replace(comparison, reference=failed, candidates=(quick,), deviations=deviations, changes=changes)
    assert "3 of 5 frames were reached, up to frame 20" in page.render(with_bars(one))
    text = re.sub(r"<script.*?</script>", "", page.render(one), flags=re.DOTALL)
    assert "The reference (fenicsx): diverged.</b> no equilibrium near the foot; try smaller steps. 3 of 5 " in text
    assert '<span class="badge fail">fail</span> <b>reference</b>: 1 of 1 of its own checks met; diverged' in text
    assert "not a number" not in text
    assert "frame 40" not in text.replace("from frame 0", "")
    unmet = replace(one.verdicts[0], word="fail", value=NAN, frame=30)
    text = re.sub(r"<script.*?</script>", "", page.render(replace(one, verdicts=(unmet,))), flags=re.DOTALL)
    assert "not a number" not in text
    assert "<td>not reached" in text
    nowhere = replace(failed, positions=np.full_like(positions, NAN))
    apart = {"quick": measured(quick, nowhere.positions)}
    text = page.render(replace(one, reference=nowhere, deviations=apart))
    assert "No frame was reached, so that nothing could be measured against it." in text
    assert "How far from the reference" not in text
    assert "not a number" not in re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL)
    assert "What it cost" in text
    assert 'type="module"' not in text


def test_what_each_frame_of_the_reference_took_is_shown_where_it_is_known(comparison):
    seconds = {"seconds_processor": np.arange(5.0), "contact_points": np.array([0.0, 0, 17, 0, NAN])}
    known = replace(alone(comparison), reference=replace(comparison.reference, scalars=seconds))
    text = page.render(known)
    assert "Processor time of the reference to each frame" in text
    assert re.search(r"<th>Frame</th><th>processor time \[s\]</th><th>points in contact</th>", text)
    assert "<td>17</td>" in text
    assert "Processor time of the reference" not in page.render(alone(comparison))
