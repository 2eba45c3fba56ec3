"""``effects = "auto"`` keeps what makes a force and moves little, and finds out what only a solution shows."""

import importlib.util
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import random_scenes
import shapes
import small
import stand_ins

from fem_reference import cli
from fem_reference.effects import make
from fem_reference.problems import guess, muscle, of_case
from fem_reference.problems.estimates import STRESS_TOLERANCE, estimates
from fem_reference.problems.setup import Setup
from fem_reference.problems.stresses import StressSamples, StressSizes, kirchhoff
from fem_reference.runs.store import Frame, Outcome, Run
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import fenicsx
from fem_reference.studies import run_folders, watched
from fem_reference.studies.execution import Bench

ACTIVE = """
[[effect]]
name = "fibre_active"
stress = "300 kPa"
optimal_stretch = 1.0
ramp = [{ frame = 0, amount = 0.0 }, { frame = 4, amount = 1.0 }]
"""
# Of a scene of random_scenes.TEXT whose bones rest.
STILL = {
    "direction": [0, 0, 1],
    "distance": 0.0,
    "centre": "100, 0, 20",
    "radius": 5,
    "mu": 10,
    "bulk": 10_000,
    "every": 1,
    "interval": 1.0,
    "states": "false",
    "slack": 1.1,
    "passive": 300,
}


def pennate(folder: Path, choice: str, effects: str = ACTIVE) -> MuscleCase:
    """A bar between two fixed plates with fibres at 25 degrees to its axis."""
    case = random_scenes.TEXT.format(**STILL, choice=choice, effects=effects).replace(
        "first_step = 4", "first_step = 1"
    )
    return random_scenes.write(folder, case, random_scenes.lines(np.tan(np.radians(25)), 0.0))


def asked(bench: Bench[MuscleCase]) -> Run:
    """The reference's run, of which a stand-in for the solver has no states to keep."""
    return bench.obtain("reference", run_folders.without_states(bench.scene.reference), "reference")


def spindle(folder: Path, choice: str, effects: str = ACTIVE) -> MuscleCase:
    """A muscle that is thicker in its middle, between fixed plates, with fibres from one to the other."""
    path = small.write(folder) / "case.toml"
    case = path.read_text().replace('"0.4 rad"', '"0 rad"').replace("last = 20\nevery = 5", "last = 4\nevery = 2")
    case = case.replace("frame = 20", "frame = 3").replace("frame = 10", "frame = 2") + effects.replace("300", "10")
    path.write_text(f'effects = "{choice}"\n{case}')
    return casefile.read_muscle(path.parent)


@pytest.fixture(scope="module")
def fem() -> Iterator[None]:
    if not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")):
        pytest.skip("FEniCSx is not installed")
    with fenicsx.shared():
        yield


@pytest.mark.slow
@pytest.mark.usefixtures("fem")
@pytest.mark.parametrize(("scene", "moves"), [(pennate, 5.0), (spindle, 0.05)])
def test_an_isometric_contraction_is_that_of_the_listed_effects(scene, moves, tmp_path) -> None:
    """300 kPa, or 10, between bones that rest: by an indicator of displacement alone nothing happened, and forces were 0."""
    found = []
    for choice in ("listed", "auto"):
        case = scene(tmp_path / choice, choice)
        bench = Bench(case, tmp_path / f"runs of {choice}")
        found.append(bench.obtain("reference", case.reference, "reference"))
    listed, chosen = found
    assert listed.outcome.status == chosen.outcome.status == "converged", listed.outcome.message
    assert chosen.positions == pytest.approx(listed.positions, abs=1e-6)
    # Fibres of 300 kPa pull at 100 mm2 with 30 N, less what the matrix is pressed and, of the oblique ones, what ends at the sides;
    # those of 10 kPa with a thirtieth.
    forces = chosen.scalars["force_origin"]
    assert 0.5 < forces[-1] < 40
    assert forces == pytest.approx(listed.scalars["force_origin"], rel=1e-6, abs=1e-9)
    assert np.abs(listed.positions - listed.positions[0]).max() > moves


def test_all_that_makes_a_stress_where_nothing_else_does_is_kept(tmp_path) -> None:
    """Each alone, however small, but above what rounding makes; the line says which quantity decided, and with what number."""
    for name, more in random_scenes.EFFECTS.items():
        if name in ("contact", "damping", "fibre_passive"):  # which do nothing where nothing moves
            continue
        values = STILL | {"activation": 1e-4, "density": 0.1, "weight": "0, 0, -9.81", "pressure": 1e-4}
        scene = of_case.chosen(pennate(tmp_path / name, "auto", more.format(**values)))
        assert scene.decisions[-1].needed, name
        assert "kPa of stress" in str(scene.decisions[-1])
    assert "Pressure on free: needed, about 0.0001 kPa of stress, 5e-08 kPa allowed" in str(scene.decisions[-1])


def test_what_does_nothing_is_left_out_where_nothing_moves(tmp_path) -> None:
    values = STILL | {"activation": 0.0, "drag": 1.0, "contact": 500.0}
    more = "".join(random_scenes.EFFECTS[name] for name in ("active_tension", "fibre_passive", "damping", "contact"))
    scene = of_case.chosen(pennate(tmp_path / "still", "auto", more.format(**values)))
    assert [one.needed for one in scene.decisions] == [True, True, False, False, False, False]
    assert all("kPa of stress" in str(one) for one in scene.decisions[2:])


def test_a_motion_allows_stresses_of_its_own_size(tmp_path) -> None:
    """Bones that draw the bar a tenth longer: a strain of 0.1 in a matrix of 10 kPa; and bones that move together do not."""
    case = random_scenes.TEXT.format(**STILL | {"distance": 4.0}, choice="auto", effects="")
    scene = random_scenes.write(tmp_path / "longer", case, random_scenes.lines(0.0, 0.0))
    rest = muscle.setup(scene)
    known = estimates(scene, rest)
    assert known.stress_tolerance == pytest.approx(STRESS_TOLERANCE * 0.01 * 0.1, rel=0.1)
    together = tuple(replace(entry, bone=rest.attached[1].bone) for entry in rest.attached)
    alike = estimates(scene, Setup(rest.surface, rest.bones, together, rest.frames, rest.interval))
    assert alike.travel == pytest.approx(4.0)
    assert alike.stress_tolerance < 1e-4 * known.stress_tolerance


def test_what_happens_in_the_middle_of_a_motion_is_asked_for(tmp_path) -> None:
    """A bone that comes down to the bar, 10 mm wide, and is back at the last frame."""
    values = STILL | {"centre": "5, 17, 20", "contact": 500.0}
    case = random_scenes.TEXT.format(**values, choice="auto", effects=random_scenes.EFFECTS["contact"].format(**values))
    path = '[{ frame = 0, distance = "0 mm" }, { frame = 2, distance = "3 mm" }, { frame = 4, distance = "0 mm" }]'
    ball = 'name = "ball"\nmotion = { direction = [0, -1, 0], keyframes = ' + path + " }"
    scene = random_scenes.write(tmp_path / "ball", case.replace('name = "ball"', ball), random_scenes.lines(0.0, 0.0))
    contact = of_case.explained(scene)[-1]
    assert contact.needed
    assert "ball, nearest at frame 2" in str(contact)


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


def test_fibres_at_an_angle_lean_by_the_sine_of_twice_that(tmp_path) -> None:
    scene = pennate(tmp_path / "scene", "auto")
    assert estimates(scene, muscle.setup(scene)).lean == pytest.approx(np.sin(np.radians(50)))
    case = random_scenes.TEXT.format(**STILL, choice="auto", effects="")
    straight = random_scenes.write(tmp_path / "straight", case, random_scenes.lines(0.0, 0.0))
    assert estimates(straight, muscle.setup(straight)).lean == pytest.approx(0, abs=1e-6)


def test_a_strain_is_what_no_rigid_motion_makes() -> None:
    points = shapes.box((2, 2, 8), (10, 10, 40)).points
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    assert guess.strain(points, points @ turn.T + [3, -2, 70]) == pytest.approx(0, abs=1e-12)
    assert guess.strain(points, 1.1 * points @ turn.T) == pytest.approx(0.1)
    assert guess.strain(points, 5 * points) == 1


def test_fibres_stretched_at_rest_are_asked_for_at_that_stretch(tmp_path) -> None:
    """Slack up to 1.05, and stretched by 1.2 without any motion."""
    more = """
[[effect]]
name = "prestretch"
stretch = 1.2
ramp = [{ frame = 0, amount = 0.0 }, { frame = 4, amount = 1.0 }]
"""
    passive = random_scenes.EFFECTS["fibre_passive"].format(**STILL | {"slack": 1.05})
    found = [
        of_case.chosen(pennate(tmp_path / name, "auto", text)) for name, text in (("a", passive), ("b", more + passive))
    ]
    assert [one.decisions[-1].needed for one in found] == [False, True]


def test_listed_effects_are_said_to_act(tmp_path, capsys) -> None:
    """Far away bones and no weight: "auto" would leave both out, and "listed" does not."""
    values = STILL | {"contact": 500.0}
    for choice, said in (("listed", False), ("auto", True)):
        scene = pennate(tmp_path / choice, choice, random_scenes.EFFECTS["contact"].format(**values))
        for verb in (["validate", str(scene.folder)], ["run", str(scene.folder), "--explain"]):
            assert cli.main(verb) == cli.DONE
            printed = capsys.readouterr().out
            assert ("left out" in printed) is said, verb
            assert ("acts, as it is listed" in printed) is not said


def test_stresses_of_a_stretched_bar_are_those_of_the_closed_form() -> None:
    """At constant volume ``mu (B - I tr B / 3)``, and fibres along it that pull with ``l dW/dl``, deviatoric as well."""
    mesh, stretch, mu, pull = shapes.box((1, 1, 2), (1.0, 1.0, 2.0)), 1.2, 0.01, 0.03
    F = np.diag([stretch**-0.5, stretch**-0.5, stretch])
    fibre = np.tile([0.0, 0.0, 1.0], (len(mesh.tets), 1))
    acting = [(make("neo_hooke", mu=mu), 1.0), (make("incompressible", bulk=10.0), 1.0)]
    active = make("active_tension", tension=pull, ramp=[{"frame": 0, "amount": 1.0}])
    found = StressSamples(mesh, fibre).sizes(mesh.points @ F.T, acting, [(active, 0.5)])
    share = np.sqrt(2 / 3)  # of the deviator of a uniaxial stress
    assert found.acts == pytest.approx(mu * (stretch**2 - 1 / stretch) * share, rel=1e-9)
    assert found.added == pytest.approx([0.5 * pull * stretch**2 * share], rel=1e-9)
    assert found.stretch == pytest.approx((stretch, stretch))
    both = kirchhoff([*acting, (active, 0.5)], np.tile(F, (2000, 1, 1)), np.tile(fibre[0], (2000, 1)))
    assert both[1999] == pytest.approx(both[0], rel=1e-12)  # of parts that are evaluated one after the other


def test_a_prestretch_counts_by_what_it_changes_of_the_rest() -> None:
    """At rest the energies see a bar stretched by 1.1: its stress. What is stretched by that already has a stress of its own, which
    is no part of what the prestretch adds.
    """
    mesh, stretch, mu = shapes.box((1, 1, 1), (1.0, 1.0, 1.0)), 1.1, 0.01
    fibre = np.tile([1.0, 0.0, 0.0], (len(mesh.tets), 1))
    effect = make("prestretch", stretch=stretch, ramp=[{"frame": 0, "amount": 1.0}])
    found = StressSamples(mesh, fibre).sizes(mesh.points, [(make("neo_hooke", mu=mu), 1.0)], [(effect, 1.0)])
    assert StressSamples(mesh, fibre).sizes(mesh.points, [(effect, 1.0)], []).stretch == pytest.approx(
        (stretch, stretch)
    )
    assert found.acts == pytest.approx(0.0, abs=1e-12)
    longer = mesh.points * [stretch, stretch**-0.5, stretch**-0.5]
    own = StressSamples(mesh, fibre).sizes(longer, [(make("neo_hooke", mu=mu), 1.0)], [(effect, 1.0)])
    (uniaxial, doubly) = (mu * (one**2 - 1 / one) * np.sqrt(2 / 3) for one in (stretch, stretch**2))
    assert own.acts == pytest.approx(uniaxial)
    assert own.added == pytest.approx([doubly - uniaxial])
    assert found.added == pytest.approx([mu * (stretch**2 - 1 / stretch) * np.sqrt(2 / 3)], rel=1e-9)


def solved_as(monkeypatch: pytest.MonkeyPatch, moved) -> list[list[str]]:
    """Let the reference put the surface and the tets where ``moved`` says for (points, frame); the effects of each solution."""
    made = []

    def solve(problem, _settings, sink) -> Outcome:
        made.append([effect.title for effect in problem.effects])
        for number in problem.frames:
            places = (
                moved(points, number) for points in (problem.surface.points, problem.fibres.points, problem.mesh.points)
            )
            sink(Frame(number, *places))
        return Outcome("converged", "done", {"seconds": 1.0})

    stand_ins.solve_by(monkeypatch, fenicsx, solve)
    return made


def inside(points, number):
    """Points on the skin of the bar rest; those inside move along it, which stretches fibres there."""
    z = points[:, 2]
    off = np.abs(points[:, :2] - 5).max(axis=1) < 4.9
    return points + (off * (z > 15) * (z < 25) * 0.5 * number)[:, None] * np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("stored", [False, True])
def test_fibres_that_are_stretched_inside_only_are_added(stored, tmp_path, monkeypatch, caplog) -> None:
    """The surface rests, and the guess with it: only tetrahedra show it, of a run that is made and of one that is found stored."""
    made = solved_as(monkeypatch, inside)
    if stored:  # by somebody who listed just what "auto" keeps
        plain = pennate(tmp_path / "plain", "listed", "")
        asked(Bench(plain, tmp_path / "runs"))
    scene = pennate(tmp_path / "scene", "auto", random_scenes.EFFECTS["fibre_passive"].format(**STILL))
    bench = Bench(scene, tmp_path / "runs")
    assert len(bench.scene.effects) == 2
    with caplog.at_level("INFO", logger="fem_reference"):
        run = asked(bench)
    assert [len(titles) for titles in made] == [2, 3]
    assert "FibrePassive: needed as it turned out at frame" in caplog.text
    assert "FibrePassive" in run.origin["effects"]


def test_a_run_that_was_watched_to_its_end_is_not_watched_again(tmp_path, monkeypatch) -> None:
    made = solved_as(monkeypatch, lambda points, _: points)
    scene = pennate(tmp_path / "scene", "auto", random_scenes.EFFECTS["fibre_passive"].format(**STILL))
    for _ in range(2):
        bench = Bench(scene, tmp_path / "runs")
        run = asked(bench)
    assert len(made) == 1
    assert run.origin["watched"] == bench.watch().names
    assert bench.watch().frames == {}
    watched.begin(bench.watch(), SimpleNamespace(folder=run.folder, frames=run.numbers[:3]))  # of one that was cut off
    assert tuple(bench.watch().frames) == run.numbers[:3]
    assert all(one.stresses.acts == pytest.approx(0, abs=1e-12) for one in bench.watch().frames.values())


def test_an_effect_whose_stress_is_no_number_is_needed(tmp_path) -> None:
    """Energies with logarithms have none beyond their range: nothing shows that such an effect may be left out."""
    weight = random_scenes.EFFECTS["gravity"].format(density=1e-6, weight="0, 0, -9.81")
    watch = Bench(pennate(tmp_path / "scene", "auto", weight), tmp_path / "runs").watch()
    rest = watch.rest.surface.points
    for added, titles in ((0.0, []), (np.nan, ["Gravity"])):
        watch.sampled = SimpleNamespace(sizes=lambda *_, added=added: StressSizes(1.0, (added,), (1.0, 1.0)))
        assert [one.effect.title for one in watch.see(0, rest, rest)] == titles


def test_what_loads_move_has_a_speed(tmp_path, monkeypatch) -> None:
    """Bones rest, so that there is no drag by what is known before; the solution moves."""
    made = solved_as(
        monkeypatch, lambda points, number: points + [0.5 * number * np.sin(np.pi * points[:, 2:] / 40), 0, 0][0]
    )
    drag = random_scenes.EFFECTS["damping"].format(drag=1e-2)
    scene = pennate(tmp_path / "scene", "auto", ACTIVE + drag)
    bench = Bench(scene, tmp_path / "runs")
    assert "Damping: left out" in str(bench.scene.decisions[-1])
    bench.obtain("reference", scene.reference, "reference")
    assert [len(titles) for titles in made] == [3, 4]


@pytest.mark.slow
@pytest.mark.usefixtures("fem")
def test_a_run_that_is_stopped_at_its_end_goes_on_with_what_matters(tmp_path) -> None:
    """Springs so soft that the bar hardly follows its bones, though these draw it a third longer: its weight is some of the force.
    At frame 0 it does not act yet, so that this frame is good.
    """
    weight = random_scenes.EFFECTS["gravity"].format(density=20.0, weight="0, 0, -9.81")
    found = []
    for choice in ("auto", "listed"):
        case = random_scenes.TEXT.format(**STILL | {"distance": 12.0, "every": 2}, choice=choice, effects=weight)
        case = case.replace('"1.5 mm"', '"1.5 mm"\nstiffness = "0.01 kPa/mm"')
        scene = random_scenes.write(tmp_path / choice, case, random_scenes.lines(0.0, 0.0))
        bench = Bench(scene, tmp_path / f"runs of {choice}")
        found.append(bench.obtain("reference", scene.reference, "reference"))
    chosen, listed = found
    assert any("Gravity: needed as it turned out at frame 0" in text for text in chosen.origin["effects_chosen"])
    assert "effects were added, from frame 0 on" in chosen.outcome.message
    assert chosen.positions == pytest.approx(listed.positions, abs=1e-6)
    # 4 cm3 of 20 kg/m3 weigh 0.78 mN, which one bone carries more than the other does; springs of 1e-5 MPa/mm over 100 mm2.
    forces = [chosen.scalars[f"force_{name}"][-1] for name in ("origin", "insertion")]
    assert abs(forces[1] - forces[0]) == pytest.approx(4000 * 20e-12 * 9810, rel=1e-3)


def test_at_its_end_a_run_is_judged_by_the_stress_that_there_was(tmp_path, monkeypatch) -> None:
    """Bones draw at springs that yield: the matrix is hardly strained, and the weight is more than was thought beside it."""
    weight = random_scenes.EFFECTS["gravity"].format(density=10.0, weight="0, 0, -9.81")
    case = random_scenes.TEXT.format(**STILL | {"distance": 12.0}, choice="auto", effects=weight)
    found = []
    for name, strain in (("loose", 1e-3), ("tight", 0.3)):
        made = solved_as(monkeypatch, partial(longer, strain))
        scene = random_scenes.write(tmp_path / name, case, random_scenes.lines(0.0, 0.0))
        bench = Bench(scene, tmp_path / f"runs {name}")
        assert "Gravity: left out" in str(bench.scene.decisions[-1])
        bench.obtain("reference", scene.reference, "reference")
        found.append([len(titles) for titles in made])
    assert found == [[2, 3], [2]]


def longer(strain, points, number):
    """Points of a bar that gets longer by a ``strain`` up to frame 4, and thinner."""
    return points * (1 + strain * number / 4 * np.array([-0.5, -0.5, 1.0]))
