"""Pictures of a comparison: the frames that they show, the cameras, and the program that draws them."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from fem_reference.foundations.errors import MissingSoftware
from fem_reference.foundations.mesh import Surface
from fem_reference.geometry.rigid_bodies import HalfSpace
from fem_reference.geometry.tessellation import tessellated
from fem_reference.problems.setup import Bone
from fem_reference.report import gallery
from tests.report.comparisons import a_run, html


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
    monkeypatch.setattr(gallery, "program", lambda _job, _folder: command)
    monkeypatch.setattr(gallery, "SECONDS", 2 if "60" in command[-1] else 60)
    with pytest.raises(MissingSoftware, match=f"{why}.*libegl1"):
        gallery.draw(comparison.setup, comparison.reference.surface, gallery.shots(comparison))
    if why == "code 3":
        assert "apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri" in html(comparison)


def test_shots_are_the_worst_frames_that_can_be_drawn(comparison):
    chosen = [(shot.name, shot.number) for shot in gallery.shots(comparison)]
    # The reference moves on to the end; the last frame of "torn" is not a number.
    assert chosen == [("reference", 0), ("reference", 40), ("quick", 40), ("torn", 30)]
    quick = gallery.shots(comparison)[2]
    np.testing.assert_allclose(quick.distances, 4.0, rtol=1e-12)
    np.testing.assert_array_equal(quick.outline, comparison.reference.positions[4])


@pytest.mark.slow
def test_a_candidate_without_a_frame_to_draw_is_reported(comparison, monkeypatch):
    lost = a_run("torn", "recorded", np.full_like(comparison.reference.positions, np.inf), "diverged")
    changed = replace(comparison, candidates=(comparison.candidates[0], lost))
    monkeypatch.setattr(gallery, "draw", lambda _setup, _surface, wanted: [(b"1", b"2") for _ in wanted])
    assert [shot.name for shot in gallery.shots(changed)] == ["reference", "reference", "quick"]
    assert "<b>torn</b> has no frame whose coordinates are all numbers" in html(changed)


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_cameras_look_at_the_widest_side_away_from_the_bones(comparison, up):
    # Half axes 30, 20, 10: widest seen along z, a quarter turn about x on from there is y.
    rng = np.random.default_rng(3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    body = comparison.setup.surface
    bone = Surface((body.points + np.array([0, 12, -25 * up])) @ turn.T, body.triangles)
    views = gallery.directions(body.moved_to(body.points @ turn.T), (Bone("plate", bone, None),))
    # The body is symmetric, so only rounding is between its axes and the computed ones.
    np.testing.assert_allclose(views @ turn, [[0, 0, up], [0, -1, 0]], atol=1e-9)


def test_cameras_look_along_the_coordinates_where_two_axes_are_as_long(comparison):
    body = comparison.setup.surface
    points = body.points / [30, 20, 10] * [20, 8, 20] + np.random.default_rng(4).normal(size=body.points.shape) * 1e-12
    plate = Bone("plate", body.moved_to(body.points - [300, 200, 100]), None)
    np.testing.assert_allclose(gallery.directions(body.moved_to(points), (plate,)), [[0, 1, 0], [1, 0, 0]], atol=0.01)


def test_cameras_do_not_look_through_plates(comparison):
    # Half axes 30, 20, 10 again, now between plates across z: seen along y and x. With one plate alone, from its other side.
    body = comparison.setup.surface
    floor, lid = (HalfSpace((0, 0, -10 * up), (0, 0, up)) for up in (1, -1))
    bones = tuple(Bone("plate", tessellated(solid, body.points, "plate"), None, solid=solid) for solid in (floor, lid))
    np.testing.assert_allclose(np.abs(gallery.directions(body, bones)), [[0, 1, 0], [1, 0, 0]], atol=1e-9)
    np.testing.assert_allclose(gallery.directions(body, bones[:1])[0], [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(gallery.directions(body, bones[1:])[0], [0, 0, -1], atol=1e-9)
