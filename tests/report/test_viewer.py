"""The 3D view: what is packed into the page is what the runs are."""

import hashlib
import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest
import shapes

from fem_reference.problems.setup import Bone
from fem_reference.report import comparison_page, viewer, viewer_fields
from tests.report.comparisons import NAN, NUMBERS, html
from tests.report.packed import positions, top, unpacked

pytestmark = pytest.mark.slow


def test_the_library_is_as_it_was_published():
    card = tomllib.loads((viewer.THREE / "card.toml").read_text())
    files = {path.name: path.read_bytes() for path in viewer.THREE.iterdir() if path.name != "card.toml"}
    assert {name: hashlib.sha256(text).hexdigest() for name, text in files.items()} == card["sha256"]
    assert f'"{card["version"].split(".")[1]}"'.encode() in files["three.core.min.js"]
    assert b"The MIT License" in files["LICENSE"]


def test_what_is_packed_is_every_frame_of_every_run(comparison):
    seen = viewer.view(comparison)
    data = json.loads(seen["data"])
    assert (seen["candidates"], seen["numbers"], seen["every"]) == (["quick", "torn"], NUMBERS, 1)
    assert data["frames"] == list(NUMBERS)
    np.testing.assert_array_equal(
        unpacked(data["triangles"], "<u4").reshape(-1, 3), comparison.reference.surface.triangles
    )
    for run, printed in zip([comparison.reference, *comparison.candidates], data["runs"], strict=True):
        known = np.isfinite(run.positions).all(axis=(1, 2))
        assert printed["reached"] == known.tolist()
        assert printed["off"] == [0] * 5
        # Rounding is half a step, and of numbers of 60 mm 1e-14.
        off = np.abs(positions(printed, data, 5) - run.positions)[known].max()
        assert off <= seen["error"] + 1e-12
    # From -30 - 0 to 30 + 8 mm along x, in 65535 steps.
    assert seen["error"] == pytest.approx(68 / 65535 / 2, rel=1e-9)


def test_the_scale_ends_at_the_greatest_distance_and_each_run_names_its_worst_frame(comparison):
    data = json.loads(viewer.view(comparison)["data"])
    # quick is 1 mm a frame away; torn half of that, and its last frame is not a number.
    assert top(data) == pytest.approx(4.0, rel=1e-12)
    assert [run["worst"] for run in data["runs"]] == [[0, 0], [pytest.approx(4), 4], [pytest.approx(1.5), 3]]


def test_bones_have_a_pose_for_each_frame_and_few_triangles(comparison):
    data = json.loads(viewer.view(comparison)["data"])
    (bone,), body = data["bones"], comparison.setup.bones[0]
    np.testing.assert_allclose(bone["poses"], [body.pose(number).ravel() for number in NUMBERS], atol=0)
    points = positions(bone, bone, 1)[0]
    assert np.abs(points - body.surface.points).max() <= bone["step"] / 2 + 1e-12
    fine = Bone("fine", shapes.sphere(5, 20.0), None)
    assert len(fine.surface.triangles) > viewer.BONE_TRIANGLES
    changed = replace(comparison, setup=replace(comparison.setup, bones=(fine,)))
    (bone,) = json.loads(viewer.view(changed)["data"])["bones"]
    assert 0 < len(unpacked(bone["triangles"], "<u4")) <= 3 * viewer.BONE_TRIANGLES


def test_a_run_of_lines_alone_is_left_out(comparison):
    lines = replace(comparison.candidates[0], has_surface=False)
    seen = viewer.view(replace(comparison, candidates=(lines, comparison.candidates[1])))
    assert seen["candidates"] == ["torn"]
    assert [run["name"] for run in json.loads(seen["data"])["runs"]] == ["reference", "torn"]


def test_a_run_without_any_number_shows_nothing(comparison):
    lost = replace(comparison.candidates[1], positions=np.full_like(comparison.reference.positions, np.inf))
    data = json.loads(viewer.view(replace(comparison, candidates=(lost,)))["data"])
    assert (data["runs"][1]["reached"], top(data)) == ([False] * 5, 0.0)


def test_a_reference_without_any_number_leaves_the_candidates(comparison):
    lost = replace(comparison.reference, positions=np.full_like(comparison.reference.positions, NAN))
    data = json.loads(viewer.view(replace(comparison, reference=lost))["data"])
    assert [run["reached"][0] for run in data["runs"]] == [False, True, True]
    assert top(data) == 0


def test_vertices_that_scatter_are_counted_and_leave_the_others_their_digits(comparison):
    moved = np.array(comparison.candidates[0].positions)
    moved[3, 7] = [1e6, 0, 0]
    moved[4, :2] = 1e300
    seen = viewer.view(replace(comparison, candidates=(replace(comparison.candidates[0], positions=moved),)))
    data = json.loads(seen["data"])
    assert data["runs"][1]["off"] == [0, 0, 0, 1, 2]
    # The reference's box is 68 x 40 x 20, so that none is greater than three times its diagonal.
    assert seen["error"] < 3 * np.hypot(68, np.hypot(40, 20)) / 65535 / 2
    # 1e6 is drawn at the edge of the box and sets no scale, nor does what else is in such a frame: 2 mm off are those before.
    assert top(data) == pytest.approx(2.0, rel=1e-12)
    assert data["runs"][1]["worst"] == [pytest.approx(4.0), 4]


# A frame of three runs of 66 vertices, three coordinates of two bytes each and two levels of one.
FRAME = 3 * 66 * 8


@pytest.mark.parametrize(
    ("budget", "every", "numbers"),
    [(5 * FRAME, 1, NUMBERS), (3 * FRAME, 2, (0, 20, 40)), (1, 4, (0, 40))],
)
def test_beyond_its_budget_the_page_has_fewer_frames(comparison, budget, every, numbers):
    seen = viewer.view(comparison, budget)
    assert (seen["every"], seen["numbers"]) == (every, numbers)
    data = json.loads(seen["data"])
    assert {len(bone["poses"]) for bone in data["bones"]} == {len(numbers)}
    at = [NUMBERS.index(number) for number in numbers]
    off = np.abs(positions(data["runs"][0], data, len(at)) - comparison.reference.positions[at]).max()
    assert off <= seen["error"] + 1e-12


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
    monkeypatch.setattr(viewer_fields, "fibre_points", lambda run, _: np.zeros((len(run.numbers), 1000, 3)))
    seen = viewer.view(replace(changed, candidates=tuple(given[1:])))
    packed = 4 * 31 * 10242 * (3 * 2 + 2)
    assert seen["every"] == 1
    assert packed < viewer.BUDGET
    # Library, triangles, bones and fibres are what is left; 15 MB are the whole page's.
    assert len(seen["data"]) < 4 / 3 * packed + 1e6 < 4 / 3 * viewer.BUDGET + 1e6 < 15e6


def test_fewer_frames_are_reported(comparison, monkeypatch):
    assert "is drawn here" not in html(comparison)
    monkeypatch.setattr(comparison_page, "view", lambda it: viewer.view(it, 3 * FRAME))
    assert "<b>one frame in 2 is drawn here</b>" in html(comparison)


def test_no_name_ends_the_script(comparison):
    quick = replace(comparison.candidates[0], name="</script><!--")
    data = viewer.view(replace(comparison, candidates=(quick,)))["data"]
    assert "<" not in data
    assert json.loads(data)["runs"][1]["name"] == quick.name
