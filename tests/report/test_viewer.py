"""The 3D view: what is packed into the page is what the runs are, and a browser draws it without a network."""

import base64
import gzip
import hashlib
import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapes
from browser import PROGRAM, Browser

from fem_reference.assessment import local_fields
from fem_reference.assessment.error_bars import ErrorBar, ErrorBars
from fem_reference.foundations.mesh import Polylines
from fem_reference.problems.setup import RigidBody
from fem_reference.report import page, viewer, viewer_fields
from fem_reference.report.sections import frames
from tests.report import test_page as test_report

pytestmark = pytest.mark.slow

NAN = float("nan")
comparison = test_report.comparison
UP = "!document.getElementById('viewer').hidden"


def unpacked(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(gzip.decompress(base64.b64decode(text)), kind).astype(np.int64)


def positions(printed: dict, box: dict, frames: int) -> np.ndarray:
    """The positions (frames, n, 3) [mm] of a run, unpacked as the module's text says."""
    low, high = unpacked(printed["positions"], "u1").reshape(2, -1)
    zigzag = low + 256 * high
    steps = np.where(zigzag % 2, -(zigzag + 1) // 2, zigzag // 2).reshape(frames, -1, 3)
    return box["low"] + box["step"] * (np.cumsum(steps, axis=0) % 65536)


def top(data: dict) -> float:
    """The greatest distance [mm] to the same vertex."""
    return next(one["top"] for one in data["quantities"] if one["name"] == "distance")


def levels(data: dict, run: int, name: str, frames: int) -> np.ndarray:
    """The values (frames, n) [mm] of a quantity, unpacked as ``viewer_fields`` says."""
    (scale,) = (one["top"] for one in data["quantities"] if one["name"] == name)
    steps = unpacked(data["runs"][run]["levels"][name], "u1").reshape(frames, -1)
    level = np.cumsum(steps, axis=0).astype(np.uint8).view(np.int8) / 127.0
    return np.sign(level) * scale * level**2


def test_the_library_is_as_it_was_published():
    card = tomllib.loads((viewer.THREE / "card.toml").read_text())
    files = {path.name: path.read_bytes() for path in viewer.THREE.iterdir() if path.name != "card.toml"}
    assert {name: hashlib.sha256(text).hexdigest() for name, text in files.items()} == card["sha256"]
    assert f'"{card["version"].split(".")[1]}"'.encode() in files["three.core.min.js"]
    assert b"The MIT License" in files["LICENSE"]


def test_what_is_packed_is_every_frame_of_every_run(comparison):
    seen = viewer.view(comparison)
    data = json.loads(seen.data)
    assert (seen.candidates, seen.numbers, seen.every) == (("quick", "torn"), test_report.NUMBERS, 1)
    assert data["frames"] == list(test_report.NUMBERS)
    np.testing.assert_array_equal(
        unpacked(data["triangles"], "<u4").reshape(-1, 3), comparison.reference.surface.triangles
    )
    for run, printed in zip([comparison.reference, *comparison.candidates], data["runs"], strict=True):
        known = np.isfinite(run.positions).all(axis=(1, 2))
        assert printed["reached"] == known.tolist()
        assert printed["off"] == [0] * 5
        # Rounding is half a step, and of numbers of 60 mm 1e-14.
        off = np.abs(positions(printed, data, 5) - run.positions)[known].max()
        assert off <= seen.error + 1e-12
    # From -30 - 0 to 30 + 8 mm along x, in 65535 steps.
    assert seen.error == pytest.approx(68 / 65535 / 2, rel=1e-9)


def test_the_scale_ends_at_the_greatest_distance_and_each_run_names_its_worst_frame(comparison):
    data = json.loads(viewer.view(comparison).data)
    # quick is 1 mm a frame away; torn half of that, and its last frame is not a number.
    assert top(data) == pytest.approx(4.0, rel=1e-12)
    assert [run["worst"] for run in data["runs"]] == [[0, 0], [pytest.approx(4), 4], [pytest.approx(1.5), 3]]


def test_bones_have_a_pose_for_each_frame_and_few_triangles(comparison):
    data = json.loads(viewer.view(comparison).data)
    (bone,), body = data["bones"], comparison.setup.bones[0]
    np.testing.assert_allclose(bone["poses"], [body.pose(number).ravel() for number in test_report.NUMBERS], atol=0)
    points = positions(bone, bone, 1)[0]
    assert np.abs(points - body.surface.points).max() <= bone["step"] / 2 + 1e-12
    fine = RigidBody("fine", shapes.sphere(5, 20.0), None)
    assert len(fine.surface.triangles) > viewer.BONE_TRIANGLES
    changed = replace(comparison, setup=replace(comparison.setup, bones=(fine,)))
    (bone,) = json.loads(viewer.view(changed).data)["bones"]
    assert 0 < len(unpacked(bone["triangles"], "<u4")) <= 3 * viewer.BONE_TRIANGLES


def test_a_run_of_lines_alone_is_left_out(comparison):
    lines = replace(comparison.candidates[0], has_surface=False)
    seen = viewer.view(replace(comparison, candidates=(lines, comparison.candidates[1])))
    assert seen.candidates == ("torn",)
    assert [run["name"] for run in json.loads(seen.data)["runs"]] == ["reference", "torn"]


def test_a_run_without_any_number_shows_nothing(comparison):
    lost = replace(comparison.candidates[1], positions=np.full_like(comparison.reference.positions, np.inf))
    data = json.loads(viewer.view(replace(comparison, candidates=(lost,))).data)
    assert (data["runs"][1]["reached"], top(data)) == ([False] * 5, 0.0)


def test_a_reference_without_any_number_leaves_the_candidates(comparison):
    lost = replace(comparison.reference, positions=np.full_like(comparison.reference.positions, NAN))
    data = json.loads(viewer.view(replace(comparison, reference=lost)).data)
    assert [run["reached"][0] for run in data["runs"]] == [False, True, True]
    assert top(data) == 0


def test_vertices_that_scatter_are_counted_and_leave_the_others_their_digits(comparison):
    moved = np.array(comparison.candidates[0].positions)
    moved[3, 7] = [1e6, 0, 0]
    moved[4, :2] = 1e300
    seen = viewer.view(replace(comparison, candidates=(replace(comparison.candidates[0], positions=moved),)))
    data = json.loads(seen.data)
    assert data["runs"][1]["off"] == [0, 0, 0, 1, 2]
    # The reference's box is 68 x 40 x 20, so that none is greater than three times its diagonal.
    assert seen.error < 3 * np.hypot(68, np.hypot(40, 20)) / 65535 / 2
    # 1e6 is drawn at the edge of the box and sets no scale, nor does what else is in such a frame: 2 mm off are those before.
    assert top(data) == pytest.approx(2.0, rel=1e-12)
    assert data["runs"][1]["worst"] == [pytest.approx(4.0), 4]


def with_bars(comparison, bar: float):
    values = np.array([0.0, bar, bar, bar, NAN])
    known = [
        ErrorBar("deviation", "surface_deviation", statistic, "mm", share * values, {})
        for statistic, share in (("max", 1.0), ("hausdorff", 0.5))
    ]
    return replace(comparison, error_bars=ErrorBars(test_report.NUMBERS, (1.0, 2.0), 1.0, tuple(known)))


def test_signed_distances_and_depths_are_those_of_the_runs(comparison):
    data = json.loads(viewer.view(with_bars(comparison, 0.75)).data)
    assert [one["name"] for one in data["quantities"]] == ["distance", "surface", "depth"]
    assert data["bars"] == {"distance": [0, 0.75, 0.75, 0.75, None], "surface": [0, 0.375, 0.375, 0.375, None]}
    reference, quick = comparison.reference, comparison.candidates[0]
    expected = local_fields.to_surface(quick, reference)
    found = levels(data, 1, "surface", 5)
    (scale,) = (one["top"] for one in data["quantities"] if one["name"] == "surface")
    assert scale == pytest.approx(np.abs(expected).max())
    # Half a level of 127, at its root: value = top s^2, so that it is off by at most 2 sqrt(value top) / 254 and a square of that.
    assert (np.abs(found - expected) <= np.sqrt(np.abs(expected) * scale) / 127 + scale / 254**2 + 1e-9).all()
    across = quick.positions[4][:, 2]
    # It is 4 mm off along z: outside there, inside here.
    assert found[4, np.argmax(across)] > 2
    assert found[4, np.argmin(across)] < -2
    assert data["runs"][1]["most"]["surface"] == pytest.approx(np.abs(expected).max(axis=1), rel=1e-3)
    context, body = comparison.context, comparison.setup.bones[0]
    for i, run in enumerate((reference, quick)):
        frames = zip(run.numbers, run.positions, strict=True)
        deep = np.stack([-local_fields.to_bone(body, number, points) for number, points in frames])
        deep = np.where(context.exempt.vertices, 0, np.maximum(deep, 0))
        assert (np.abs(levels(data, i, "depth", 5) - deep) <= 0.02 * deep.max() + 1e-9).all()
        assert data["runs"][i]["most"]["depth"] == pytest.approx(deep.max(axis=1), rel=1e-3)


def test_fibres_and_joints_are_those_of_the_case(comparison):
    lines = Polylines(np.array([[0.0, 0, 0], [0, 0, 2], [0, 0, 4], [1, 0, 0], [1, 0, 1]]), [0, 3, 5])
    steps = 1 + 0.1 * np.arange(5)[:, None, None] * [0, 0, 1]
    inside = replace(comparison.reference, fibres=lines, fibre_positions=lines.points * steps)
    changed = replace(comparison, reference=inside, context=replace(comparison.context, fibres=lines))
    seen = viewer.view(replace(changed, candidates=()))
    data = json.loads(seen.data)
    assert data["fibres"] == {"lines": [3, 2], "rest": [2, 2, 1], "low": 1.0, "high": pytest.approx(1.4)}
    assert seen.stretches[0] == (0.0, 1.0)
    points = positions({"positions": data["runs"][0]["points"]}, data, 5)
    assert points == pytest.approx(inside.fibre_positions, abs=seen.error + 1e-12)
    (joint,) = data["joints"]
    assert (joint["name"], joint["unit"]) == ("plate", "°")
    assert joint["values"] == pytest.approx(np.degrees([0, 0.25, 0.5, 0.75, 1]), abs=0.01)
    many = Polylines(np.random.default_rng(1).normal(size=(80 * 40, 3)), np.arange(0, 80 * 40 + 1, 40))
    crowded = replace(changed, context=replace(comparison.context, fibres=many))
    drawn, indices = viewer_fields.Fields(crowded, [inside], (0,)).lines
    assert len(drawn) == viewer_fields.FIBRES
    assert len(indices) == viewer_fields.FIBRES * viewer_fields.POINTS
    assert {0, 39, 79 * 40, 80 * 40 - 1} <= set(indices.tolist())  # the first and the last, from end to end


# A frame of three runs of 66 vertices, three coordinates of two bytes each and two levels of one.
FRAME = 3 * 66 * 8


@pytest.mark.parametrize(
    ("budget", "every", "numbers"),
    [(5 * FRAME, 1, test_report.NUMBERS), (3 * FRAME, 2, (0, 20, 40)), (1, 4, (0, 40))],
)
def test_beyond_its_budget_the_page_has_fewer_frames(comparison, budget, every, numbers):
    seen = viewer.view(comparison, budget)
    assert (seen.every, seen.numbers) == (every, numbers)
    data = json.loads(seen.data)
    assert {len(bone["poses"]) for bone in data["bones"]} == {len(numbers)}
    at = [test_report.NUMBERS.index(number) for number in numbers]
    off = np.abs(positions(data["runs"][0], data, len(at)) - comparison.reference.positions[at]).max()
    assert off <= seen.error + 1e-12


def test_a_muscle_of_the_report_fits_into_the_page_whatever_it_does(comparison, monkeypatch):
    # 10242 vertices over 31 frames and three candidates, in noise, which nothing compresses: base64 takes 4 bytes for 3.
    ball, noise = shapes.sphere(5, 40.0), np.random.default_rng(6).normal(size=(31, 10242, 3))
    numbers, runs = tuple(range(31)), [comparison.reference, *[comparison.candidates[0]] * 3]
    given = [
        replace(run, name=str(i), numbers=numbers, surface=ball, positions=ball.points + np.roll(noise, i, axis=0))
        for i, run in enumerate(runs)
    ]
    changed = replace(comparison, setup=replace(comparison.setup, surface=ball), reference=given[0])
    monkeypatch.setattr(viewer_fields.local_fields, "to_surface", lambda run, _: run.positions[:, :, 0])
    monkeypatch.setattr(viewer_fields.local_fields, "to_bones", lambda run, _: run.positions[:, :, 1])
    monkeypatch.setattr(
        viewer_fields.local_fields, "fibre_points", lambda run, _: np.zeros((len(run.numbers), 1000, 3))
    )
    seen = viewer.view(replace(changed, candidates=tuple(given[1:])))
    packed = 4 * 31 * 10242 * (3 * 2 + 2)
    assert seen.every == 1
    assert packed < viewer.BUDGET
    # Library, triangles, bones and fibres are what is left; 15 MB are the whole page's.
    assert len(seen.data) < 4 / 3 * packed + 1e6 < 4 / 3 * viewer.BUDGET + 1e6 < 15e6


def test_fewer_frames_are_reported(comparison, monkeypatch):
    assert "is drawn here" not in page.render(comparison)
    monkeypatch.setattr(page, "view", lambda it: viewer.view(it, 3 * FRAME))
    assert "<b>one frame in 2 is drawn here</b>" in page.render(comparison)


def test_no_name_ends_the_script(comparison):
    quick = replace(comparison.candidates[0], name="</script><!--")
    data = viewer.view(replace(comparison, candidates=(quick,))).data
    assert "<" not in data
    assert json.loads(data)["runs"][1]["name"] == quick.name


# ---- In a browser


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    if PROGRAM is None:
        pytest.skip("chromium is not installed: apt-get install chromium")
    with Browser(tmp_path_factory.mktemp("profile")) as opened:
        yield opened


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Without the curves, of which nothing here is."""
    monkeypatch.setattr(frames, "curves", lambda _: [])


@pytest.fixture
def opened(browser, comparison, tmp_path):
    """The page of the small comparison, drawn."""
    show(browser, comparison, tmp_path)
    return browser


def show(browser: Browser, comparison, folder: Path, fragment: str = "") -> None:
    path = folder / "report.html"
    path.write_text(page.render(comparison), encoding="utf-8")
    browser.open(path, fragment)
    browser.wait(f"document.getElementById('viewer') && {UP}")


def labels(browser: Browser) -> dict[str, tuple[str, list[float]]]:
    """What each pane shown states, and the mean [mm] of the vertices that are drawn in it, by its name."""
    found = browser.ask(
        "[...document.querySelectorAll('.viewer-label:not([hidden])')]"
        ".map((it) => [it.firstChild.textContent, it.lastChild.textContent, it.dataset.mean])"
    )
    return {name: (printed, [float(value) for value in mean.split()]) for name, printed, mean in found}


def click(browser: Browser, name: str) -> None:
    browser.ask(f"document.getElementById('viewer-{name}').click()")


def test_it_loads_without_a_request_or_a_complaint(opened):
    assert opened.complaints() == []
    assert {address.split(":")[0] for address in opened.requests()} <= {"file", "data", "blob"}
    assert len([address for address in opened.requests() if address.startswith("file:")]) == 1
    # And one would be seen: the page's own policy refuses it.
    opened.ask(
        "new Promise((go) => { const it = new Image(); it.onerror = go; it.src = 'https://example.org/a.png'; })"
    )
    assert any("Content Security Policy" in printed for printed in opened.complaints())


def body_of_reference(picture: np.ndarray) -> np.ndarray:
    """Which pixels of the first of three panes, below its label, are of the muscle's red, where bones are hidden."""
    pane = picture[50:, 5 : picture.shape[1] // 3 - 5]
    return pane[:, :, 0] > pane[:, :, 2] + 40


def test_the_slider_moves_the_mesh(opened, comparison):
    seen = viewer.view(comparison)
    error, half = seen.error, json.loads(seen.data)["camera"]["half"]
    click(opened, "bones")
    opened.ask("document.getElementById('viewer-slider').focus()")
    middles = []
    for key, i in (("Home", 0), ("ArrowRight", 1), ("End", 4), ("ArrowLeft", 3)):
        opened.press(key)
        picture = opened.picture("#viewer-stage")
        middles.append(np.argwhere(body_of_reference(picture)).mean(axis=0))
        assert opened.ask("document.getElementById('viewer-number').textContent") == str(test_report.NUMBERS[i])
        for run in (comparison.reference, *comparison.candidates):
            printed, mean = labels(opened)[run.name]
            if np.isfinite(run.positions[i]).all():
                # Each coordinate is rounded by half a step at most, and attached in 32 bits: 30 mm times 6e-8.
                np.testing.assert_allclose(mean, run.positions[i].mean(axis=0), rtol=0, atol=error + 2e-6)
            else:
                assert (printed, mean) == ("no frame", [])
    # The picture moves with it: 2 mm a frame, across the direction of view. Its half height at the target is half / cos(9 degrees);
    # the middle of the body is a few percents off that where it is not the middle of the picture.
    pixels = np.linalg.norm(np.diff(middles, axis=0), axis=1)
    pixels_per_mm = (picture.shape[0] / 2) / (half / np.cos(np.radians(9)))
    np.testing.assert_allclose(pixels / pixels_per_mm, [2, 6, 2], rtol=0.05)
    assert opened.complaints() == []


def choose(browser: Browser, quantity: str) -> None:
    browser.ask(
        f"(({{it}}) => {{ it.value = {json.dumps(quantity)}; it.dispatchEvent(new Event('change')); }})"
        "({it: document.getElementById('viewer-quantity')})"
    )


def yellow(browser: Browser) -> float:
    """Which share of the right half of the picture is yellow."""
    picture = browser.picture("#viewer-stage")
    right = picture[:, picture.shape[1] // 2 :]
    return float(((right[:, :, 0] > right[:, :, 2] + 80) & (right[:, :, 1] > right[:, :, 2] + 80)).mean())


def test_the_worst_vertex_is_reported_and_has_the_colour_at_the_end_of_the_bar(opened):
    printed = {name: text for name, (text, _) in labels(opened).items()}
    assert printed == {"reference": "", "quick": "worst vertex 4 mm", "torn": "no frame"}
    assert opened.ask("document.getElementById('viewer-full').textContent") == "4 mm"
    opened.ask("document.querySelector('input[name=viewer-candidate][value=\"2\"]').click()")
    # Viridis ends in yellow; all vertices are 4 mm away. Half axes 30 and 20 in a window of half height 1.06 x 34 or so.
    assert yellow(opened) > 0.1
    opened.ask("document.getElementById('viewer-slider').focus()")
    opened.press("Home")
    assert yellow(opened) == 0
    click(opened, "worst")
    assert yellow(opened) > 0.1
    choose(opened, "")
    assert yellow(opened) == 0
    assert opened.ask("document.getElementById('viewer-legend').hidden")


def test_what_the_reference_does_not_know_is_grey_and_said(browser, comparison, tmp_path):
    show(browser, with_bars(comparison, 2.5), tmp_path, "#frame=20")
    known = "document.getElementById('viewer-known').textContent"
    assert browser.ask(known) == "Grey: below the reference's error bar of 2.5 mm nothing is known."
    assert browser.ask("document.getElementById('viewer-joint').textContent") == "plate 28.6°"
    below = browser.picture("#viewer-stage")  # quick is 2 mm off in this frame
    browser.ask("location.hash = '#frame=30'")
    browser.wait("document.getElementById('viewer-number').textContent === '30'")
    above = browser.picture("#viewer-stage")  # and 3 mm here
    width = below.shape[1] // 3
    assert grey(below[60:, width : 2 * width]) > grey(above[60:, width : 2 * width]) + 1000
    assert "62.5%" in browser.ask("document.getElementById('viewer-ramp').style.background")  # 2.5 of 4 mm
    assert browser.ask("document.querySelector('#viewer-bins path').getAttribute('d')").count("M") >= 2  # 3 and 1.5 mm
    browser.ask("location.hash = '#frame=40'")
    browser.wait(f"{known} === 'No error bar is known for this frame.'")
    choose(browser, "surface")
    assert browser.ask("document.getElementById('viewer-half').textContent") == "0"
    assert browser.ask("document.getElementById('viewer-zero').textContent").startswith("\N{MINUS SIGN}")
    assert labels(browser)["quick"][0].startswith("farthest from the surface")
    choose(browser, "depth")
    assert "of the vertices are in bones" in browser.ask(known)
    assert browser.complaints() == []


def test_fibres_show_through_and_paper_and_dark_are_followed(opened):
    before = opened.picture("#viewer-stage")
    assert before[-3, -3].tolist() == [255, 255, 255]
    click(opened, "fibres")
    assert (np.abs(opened.picture("#viewer-stage") - before).max(axis=2) > 30).sum() > 1000
    assert not opened.ask("document.getElementById('viewer-stretch').hidden")
    opened.ask("document.documentElement.style.setProperty('--paper', '#17181b')")
    try:
        opened.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
        assert opened.picture("#viewer-stage")[-3, -3].max() < 40
        opened.ask("window.dispatchEvent(new Event('beforeprint'))")
        opened.call("Emulation.setEmulatedMedia", media="print", features=[])
        opened.wait("document.getElementById('viewer-print').complete")
        printed = opened.picture("#viewer-print")
    finally:
        opened.call("Emulation.setEmulatedMedia", media="", features=[])
    assert printed[-5, -5].tolist() == [255, 255, 255]
    assert (np.ptp(printed, axis=2) > 40).sum() > 1000
    assert opened.complaints() == []


def grey(picture: np.ndarray) -> int:
    """How many pixels have neither colour nor are they white."""
    return int(((np.ptp(picture, axis=2) < 12) & (picture.max(axis=2) < 220)).sum())


def test_panes_are_those_chosen_and_the_reference_can_lie_over_them(opened):
    assert list(labels(opened)) == ["reference", "quick", "torn"]
    click(opened, "laid")
    assert list(labels(opened)) == ["quick", "torn"]
    opened.ask("document.querySelectorAll('input[name=viewer-candidate]').forEach((box) => box.click())")
    assert list(labels(opened)) == ["reference"]
    opened.ask("document.querySelector('input[name=viewer-candidate]').click()")
    assert list(labels(opened)) == ["quick"]
    click(opened, "bones")
    click(opened, "side")
    # The candidate is above the reference by 4 of its 20 mm, and never grey; the reference shows below it, and is.
    assert grey(opened.picture("#viewer-stage")[60:]) > 1000
    click(opened, "laid")
    assert list(labels(opened)) == ["reference", "quick"]
    assert grey(opened.picture("#viewer-stage")[60:, :, :]) < 1000
    assert opened.complaints() == []


def test_bones_move_and_can_be_hidden_and_one_camera_turns_with_the_keys(browser, comparison, tmp_path):
    still = replace(comparison.reference, positions=np.repeat(comparison.reference.positions[:1], 5, axis=0))
    show(browser, replace(test_report.alone(comparison), reference=still), tmp_path, "#frame=10")
    assert browser.ask("document.getElementById('viewer-number').textContent") == "10"
    one = browser.picture("#viewer-stage")
    browser.ask("location.hash = '#frame=40'")
    browser.wait("document.getElementById('viewer-number').textContent === '40'")
    other = browser.picture("#viewer-stage")
    click(browser, "bones")
    without = browser.picture("#viewer-stage")
    browser.ask("document.getElementById('viewer-canvas').focus()")
    browser.press("ArrowUp")
    turned = browser.picture("#viewer-stage")
    click(browser, "front")
    for before, after in ((one, other), (other, without), (without, turned)):
        assert (np.abs(before - after).max(axis=2) > 8).sum() > 300
    # The focus ring apart, the view is what it was.
    np.testing.assert_allclose(browser.picture("#viewer-stage")[9:-9, 9:-9], without[9:-9, 9:-9], atol=2)
    assert browser.complaints() == []


def test_it_plays(opened):
    click(opened, "play")
    opened.wait("document.getElementById('viewer-number').textContent === '20'", seconds=10)
    assert opened.ask("document.getElementById('viewer-play').textContent") == "Pause"
    click(opened, "play")
    assert opened.ask("document.getElementById('viewer-play').textContent") == "Play"


def test_without_webgl_it_points_at_the_pictures(browser, comparison, tmp_path):
    code = "HTMLCanvasElement.prototype.getContext = () => null;"
    script = browser.call("Page.addScriptToEvaluateOnNewDocument", source=code)["identifier"]
    try:
        (tmp_path / "report.html").write_text(page.render(comparison), encoding="utf-8")
        browser.open(tmp_path / "report.html")
        browser.wait("document.getElementById('viewer-sorry')?.textContent.startsWith('No 3D view')")
    finally:
        browser.call("Page.removeScriptToEvaluateOnNewDocument", identifier=script)
    assert "the pictures below show the same" in browser.ask("document.getElementById('viewer-sorry').textContent")
    assert not browser.ask(UP)


def test_without_javascript_the_page_says_what_it_needs(comparison):
    text = re.sub(r"<script.*?</script>", "", page.render(comparison), flags=re.DOTALL)
    assert re.search(r'<p [^>]*id="viewer-sorry">This view needs JavaScript and WebGL 2; the pictures', text)
    assert '<div class="viewer" id="viewer" hidden>' in text
