"""The 3D view in a browser: it draws without a network, moves, turns, plays and is printed."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapes
from browser import PROGRAM, Browser

from fem_reference.foundations.mesh import Surface, boundary
from fem_reference.geometry.skins import quartered
from fem_reference.report import comparison_page, viewer, viewer_fields
from tests.report.comparisons import NUMBERS, alone, html
from tests.report.packed import acted_on, with_bars

pytestmark = pytest.mark.slow
UP = "!document.getElementById('viewer').hidden"


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    if PROGRAM is None:
        pytest.skip("chromium is not installed: apt-get install chromium")
    with Browser(tmp_path_factory.mktemp("profile")) as opened:
        yield opened


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Without the curves, of which nothing here is."""

    def curves(_):
        return []

    monkeypatch.setattr(comparison_page, "curves", curves)


@pytest.fixture
def opened(browser, comparison, tmp_path):
    """The page of the small comparison, drawn."""
    show(browser, comparison, tmp_path)
    return browser


def show(browser: Browser, comparison, folder: Path, fragment: str = "") -> None:
    path = folder / "report.html"
    path.write_text(html(comparison), encoding="utf-8")
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
    error, half = seen["error"], json.loads(seen["data"])["camera"]["half"]
    click(opened, "bones")
    opened.ask("document.getElementById('viewer-slider').focus()")
    middles = []
    for key, i in (("Home", 0), ("ArrowRight", 1), ("End", 4), ("ArrowLeft", 3)):
        opened.press(key)
        picture = opened.picture("#viewer-stage")
        middles.append(np.argwhere(body_of_reference(picture)).mean(axis=0))
        assert opened.ask("document.getElementById('viewer-number').textContent") == str(NUMBERS[i])
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
    assert browser.ask(known) == "Grey: below the reference's error bar of 2.5 mm."
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


def pink(picture: np.ndarray) -> int:
    """How many pixels have the colour of attached vertices."""
    return int((np.abs(picture - [0xE0, 0x21, 0x8A]).max(axis=2) < 30).sum())


def test_attached_and_touched_vertices_are_seen_until_they_are_hidden(browser, comparison, tmp_path, monkeypatch):
    monkeypatch.setattr(viewer_fields, "NEAR", 30.0)  # all of them
    show(browser, acted_on(comparison), tmp_path, "#frame=40")
    click(browser, "bones")
    seen = browser.picture("#viewer-stage")
    click(browser, "touched")
    without = browser.picture("#viewer-stage")
    assert pink(without) > 20
    assert (np.abs(seen - without).max(axis=2) > 60).sum() > 20
    click(browser, "attached")
    assert pink(browser.picture("#viewer-stage")) == 0
    assert browser.complaints() == []


@pytest.mark.parametrize(("times", "seen"), [(1, True), (4, False)])
def test_a_muscle_is_seen_through_a_plate_and_not_through_a_bone(browser, comparison, tmp_path, times, seen):
    """A box of twelve triangles around the muscle is a plate; the same box in more triangles is a bone."""
    sides = shapes.box((1, 1, 1), (100.0, 100.0, 100.0))
    corners = sides.points[boundary(sides.tets)[0]] - 50.0
    corners = corners if times == 1 else quartered(corners)
    box = Surface(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    assert len(corners) == 12 * times
    (bone,) = comparison.setup.bones
    around = replace(comparison.setup, bones=(replace(bone, surface=box),))
    show(browser, replace(alone(comparison), setup=around), tmp_path)
    picture = browser.picture("#viewer-stage").astype(int)
    red = (picture[:, :, 0] > picture[:, :, 1] + 15).sum()  # as the muscle is, and no bone
    assert (red > 1000) == seen
    assert browser.complaints() == []


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
    show(browser, replace(alone(comparison), reference=still), tmp_path, "#frame=10")
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
        (tmp_path / "report.html").write_text(html(comparison), encoding="utf-8")
        browser.open(tmp_path / "report.html")
        browser.wait("document.getElementById('viewer-sorry')?.textContent.startsWith('No 3D view')")
    finally:
        browser.call("Page.removeScriptToEvaluateOnNewDocument", identifier=script)
    assert "the pictures below show the same" in browser.ask("document.getElementById('viewer-sorry').textContent")
    assert not browser.ask(UP)


def test_without_javascript_the_page_says_what_it_needs(comparison):
    text = re.sub(r"<script.*?</script>", "", html(comparison), flags=re.DOTALL)
    assert re.search(r'<p [^>]*id="viewer-sorry">This view needs JavaScript and WebGL 2; the pictures', text)
    assert '<div class="viewer" id="viewer" hidden>' in text
