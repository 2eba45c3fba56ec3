"""Where a muscle goes by its bones, before it is solved: turns, rates in time; and what a stored run shows in one frame alone."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import shapes
import small
import stand_ins
from acting import PARAMETERS
from auto_scenes import pennate

from fem_reference.effects import make
from fem_reference.foundations.motion import RigidMotion
from fem_reference.problems import estimates, guess, muscle
from fem_reference.problems.estimates import Near
from fem_reference.runs.store import Frame, Outcome
from fem_reference.scenes import casefile
from fem_reference.solvers import fenicsx
from fem_reference.studies.execution import Bench

CONTACT = '\n[[effect]]\nname = "contact"\nstiffness = "100 kPa/mm"\nbones = ["ball"]\nsmoothing = "0.2 mm"\n'
BALL = '\n[[bone]]\nname = "ball"\nsphere = { centre = "40, 0, 15 mm", radius = "20 mm" }\n'


@pytest.mark.parametrize(("first", "last"), [(0.2, 0.5), (0.5, 0.2), (0.4, 0.4), (-0.3, 0.6)])
def test_bones_turn_against_each_other_by_the_difference(first: float, last: float) -> None:
    """About one axis through different points; turned alike they bend nothing."""
    motions = {
        name: RigidMotion((1, 2, 2), centre, (0.0, 10.0), (0.0, angle))
        for name, centre, angle in (("bottom", (0.0, 0.0, 0.0), first), ("top", (5.0, -3.0, 40.0), last))
    }
    rest = shapes.bar((1, 1, 3), (10, 10, 30), motions, (), (0, 10))
    assert guess.turn(rest, 10) == pytest.approx(abs(last - first), abs=1e-12)
    assert guess.turn(rest, 5) == pytest.approx(abs(last - first) / 2, abs=1e-12)


def slid(bottom: tuple[float, float, float] | None, top: tuple[float, float, float]):
    """A bar of 10 x 10 x 30 mm whose ends slide by 6 mm in 10 frames, each its way or not at all."""
    ways = {"bottom": bottom, "top": top}
    motions = {name: way and RigidMotion(way, None, (0.0, 10.0), (0.0, 6.0)) for name, way in ways.items()}
    return shapes.bar((2, 2, 6), (10, 10, 30), motions, (), (0, 10))


def test_a_straight_bar_sags_by_a_twentieth_of_its_travel_and_an_eighth_of_its_turn() -> None:
    rest = slid(None, (0, 3, 4))
    assert guess.thickness_of(rest) == pytest.approx(2 * 3000 / 1400, rel=1e-12)
    assert guess.length_of(rest) == pytest.approx(30, rel=1e-12)
    assert guess.sag(rest, [0, 10], 7.0) == pytest.approx(0.35, rel=1e-9)
    turned = RigidMotion((1, 0, 0), (5.0, 5.0, 30.0), (0.0, 10.0), (0.0, 0.4))
    bent = shapes.bar((2, 2, 6), (10, 10, 30), {"bottom": None, "top": turned}, (), (0, 10))
    assert guess.sag(bent, [0, 10], 7.0) == pytest.approx(0.35 + 0.4 * 30 / 8, rel=1e-9)


def test_points_between_bones_that_go_together_go_with_them() -> None:
    rest = slid((0, 3, 4), (0, 3, 4))
    follows = guess.Guess.of(rest.surface.points, rest)
    assert np.allclose(follows.at(10), rest.surface.points + [0, 3.6, 4.8], rtol=0, atol=1e-12)
    speed, _, jump, acceleration = guess.motion(follows, guess.axis_of(rest), (0, 10))
    assert speed == pytest.approx(0.6, rel=1e-9)  # 6 mm in 10 frames
    assert jump == pytest.approx(0.6, rel=1e-9)  # from rest
    assert acceleration == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(("way", "share"), [((0, 0, 1), 0.0), ((1, 0, 0), 1.0), ((3, 0, 4), 0.6)])
def test_what_goes_along_the_line_does_not_go_sideways(way: tuple[float, float, float], share: float) -> None:
    rest = slid(None, way)
    follows = guess.Guess.of(rest.surface.points, rest)
    speed, sideways, _, _ = guess.motion(follows, guess.axis_of(rest), (0, 10))
    assert 0.1 < speed < 0.6
    assert sideways == pytest.approx(share * speed, abs=1e-12)


def scene_of(folder: Path, choice: str, more: str):
    case = small.write(folder)
    path = case / "case.toml"
    path.write_text(f'effects = "{choice}"\n{path.read_text()}{more}')
    return casefile.read_muscle(case)


@pytest.mark.parametrize("seconds", [0.02, 4.0])
def test_rates_are_by_time(seconds: float, tmp_path: Path) -> None:
    """The Cauchy number has the square of the speed per second, drag the speed per second."""
    scene = scene_of(tmp_path / "bar", "listed", "")
    known = replace(estimates.estimates(scene, muscle.setup(scene)), interval=seconds)
    inertia, damping = (make(name, **PARAMETERS[name]).indicator(known) for name in ("inertia", "damping"))
    speed = known.speed / seconds  # mm/s
    assert speed > 0
    assert inertia.number == pytest.approx(1.06e-9 * speed**2 / known.shear, rel=1e-12)  # 1060 kg/m3
    assert damping.number == pytest.approx(2e-6 * speed * known.length / known.shear, rel=1e-12)  # 2 Pa s/mm2


@pytest.mark.slow
def test_what_a_stored_run_shows_in_one_frame_in_the_middle_is_seen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Solved without contact by a scene that lists none, the bar is in the ball at frame 10 of 20 and out of it again: a scene that
    left contact out has that run's key, takes it up and finds it wanting.
    """
    solved = []

    def into_the_ball_and_back(problem, _settings, sink) -> Outcome:
        solved.append([effect.title for effect in problem.effects])
        for number in problem.frames:
            shift = np.array([30.0 * (number == 10), 0, 0])
            sink(Frame(number, problem.surface.points + shift, problem.fibres.points + shift))
        return Outcome("converged", "done", {"seconds": 1.0})

    stand_ins.solve_by(monkeypatch, fenicsx, into_the_ball_and_back)
    listed = scene_of(tmp_path / "bar", "listed", BALL)
    stored = Bench(listed, tmp_path / "runs").obtain("reference", listed.reference, "reference")
    scene = scene_of(tmp_path / "bar", "auto", BALL + CONTACT)
    with monkeypatch.context() as patch:
        patch.setattr(estimates, "_near", lambda *_: Near(1e9, 0.0, 0.0))
        bench = Bench(scene, tmp_path / "runs")
    assert bench.folder(scene.reference, "reference") == stored.folder
    with caplog.at_level("INFO", logger="fem_reference"):
        bench.obtain("reference", scene.reference, "reference")
    assert solved == [["NeoHooke", "Incompressible"], ["NeoHooke", "Incompressible", "Contact"]]
    assert "Contact: found to be needed at frame 10" in caplog.text


def test_bones_that_turn_together_bend_nothing(tmp_path) -> None:
    rest, turned = muscle.setup(pennate(tmp_path / "scene", "auto")), np.eye(4)
    turned[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    for first, angle in ((turned, 0.0), (np.eye(4), np.pi / 2)):
        bones = [
            replace(rest.bones[i], motion=SimpleNamespace(pose=lambda _, pose=pose: pose))
            for i, pose in enumerate((first, turned))
        ]
        attached = tuple(replace(entry, bone=bone) for entry, bone in zip(rest.attached, bones, strict=True))
        assert guess.turn(replace(rest, attached=attached), 1) == pytest.approx(angle, abs=1e-12)


def test_a_strain_is_what_no_rigid_motion_makes() -> None:
    points = shapes.box((2, 2, 8), (10, 10, 40)).points
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    assert guess.strain(points, points @ turn.T + [3, -2, 70]) == pytest.approx(0, abs=1e-12)
    assert guess.strain(points, 1.1 * points @ turn.T) == pytest.approx(0.1)
    assert guess.strain(points, 5 * points) == 1
