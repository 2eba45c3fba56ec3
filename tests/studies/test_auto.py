"""``effects = "auto"``: which effects a scene needs is found out before it is solved, and looked at again after."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small
import stand_ins
from acting import PARAMETERS

from fem_reference import cli, effects
from fem_reference.effects import make
from fem_reference.foundations.indicators import Estimates, Near
from fem_reference.problems import estimates, muscle, of_case
from fem_reference.report.sections import origin
from fem_reference.runs.store import Frame, Outcome
from fem_reference.scenes import casefile
from fem_reference.solvers import fenicsx
from fem_reference.studies.execution import Bench

SCENE = Estimates(
    length=100.0,
    thickness=20.0,
    shear=0.01,
    tension=0.0,
    fixed=2,
    sag=10.0,
    lean=0.0,
    travel=50.0,
    stretch=(0.8, 1.3),
    interval=0.01,
    speed=0.5,
    sideways=0.4,
    jump=0.1,
    acceleration=0.01,
    frames=(0.0, 10.0, 20.0),
    tolerance=0.05,
    stress_tolerance=1e-5,
    near={"femur": Near(-3.0, 1.0, 10.0)},
)
# Of these a scene may do without; all others are the material.
CHOSEN = [name for name in effects.names(effects.Effect) if make(name, **PARAMETERS[name]).indicator(SCENE)]
CONTACT = '\n[[effect]]\nname = "contact"\nstiffness = "100 kPa/mm"\nsmoothing = "0.2 mm"\n'
BACK = '{ frame = 0, angle = "0 rad" }, { frame = 5, angle = "-0.2 rad" }'
WEIGHT = """
[[effect]]
name = "gravity"
density = "{density} kg/m3"
acceleration = "0, 0, -9.81 m/s^2"
ramp = [{{ frame = 0, amount = 0.0 }}, {{ frame = 5, amount = 1.0 }}]
"""


def test_what_loads_comes_and_goes_or_takes_time_can_be_left_out() -> None:
    assert {"contact", "gravity", "inertia", "viscosity", "damping", "fibre_active", "fibre_passive"} <= set(CHOSEN)
    assert not {"neo_hooke", "mooney_rivlin", "incompressible", "incompressible_penalty"} & set(CHOSEN)


@pytest.mark.parametrize("name", CHOSEN)
def test_an_estimate_is_a_length_whatever_the_unit_of_force(name: str) -> None:
    """With all moduli, stresses and densities twice as large, nothing moves otherwise."""
    effect = make(name, **PARAMETERS[name])
    forces = {key for key, _, unit in effect.parameters if "MPa" in unit or "tonne" in unit}
    twice = effect.model_copy(
        update={
            key: tuple(2 * one for one in value) if isinstance(value, tuple) else 2 * value
            for key, value, _ in effect.parameters
            if key in forces
        }
    )
    found, other = effect.indicator(SCENE), twice.indicator(replace(SCENE, shear=2 * SCENE.shear))
    assert other.estimate == pytest.approx(found.estimate, rel=1e-9)
    assert found.estimate > 0


@pytest.mark.parametrize("name", [name for name in CHOSEN if "ramp" in effects.find(name).model_fields])
def test_what_never_acts_is_not_needed(name: str) -> None:
    never = make(name, **PARAMETERS[name] | {"ramp": [{"frame": 0, "amount": 0.0}]})
    assert never.indicator(SCENE).estimate == 0


def test_the_sag_of_a_beam_is_that_of_timoshenko() -> None:
    # Clamped ends: w L^4 / (384 E I) + w L^2 / (8 k G A), E = 3 G, I = A d^2 / 12, k = 5/6; 0.3 of it.
    force, length, thick, shear = 1e-5, 100.0, 20.0, 0.01
    by_hand = force * length**4 * 12 / (384 * 3 * shear * thick**2) + force * length**2 * 1.2 / (8 * shear)
    assert SCENE.bend(force) == pytest.approx(0.3 * by_hand)


def test_rates_are_by_second() -> None:
    assert SCENE.in_time(2.0) == pytest.approx(200.0), "2 by frame number, of which there is one each 10 ms"
    assert replace(SCENE, interval=None).in_time(2.0) == 0.0


def test_tension_between_fixed_ends_straightens_and_makes_stiff() -> None:
    assert SCENE.straighten(1e3) == pytest.approx(0.6 * SCENE.sag, rel=1e-3)
    assert replace(SCENE, sag=0.0).straighten(1.0) == 0, "a straight muscle between fixed ends cannot shorten"
    assert replace(SCENE, sag=0.0, lean=0.5).straighten(1e3) == pytest.approx(0.15 * SCENE.length, rel=1e-3)
    assert replace(SCENE, fixed=1).straighten(1e3) == pytest.approx(0.3 * SCENE.length, rel=1e-3)
    assert replace(SCENE, tension=SCENE.shear).bend(1e-5) < SCENE.bend(1e-5) / 3


def test_what_nothing_fixes_keeps_its_weight_and_its_drag() -> None:
    loose = replace(SCENE, fixed=0)
    for name, key in (("gravity", "density"), ("damping", "coefficient")):
        little = make(name, **PARAMETERS[name]).model_copy(update={key: 1e-30})
        assert little.indicator(SCENE).estimate < SCENE.tolerance < little.indicator(loose).estimate


def test_a_body_that_is_attached_to_nothing_goes_with_the_bones_beside_it(tmp_path) -> None:
    scene = scene_of(tmp_path, "")
    loose = replace(muscle.setup(scene), attached=())
    known = estimates.estimates(scene, loose)
    assert known.fixed == 0
    assert known.travel > 1
    assert known.speed > 0


def test_small_motions_are_asked_for_more_closely(tmp_path) -> None:
    scene = scene_of(tmp_path, "")
    rest = muscle.setup(scene)
    known, slow = estimates.estimates(scene, rest), estimates.TOLERANCE * scene.muscle.tet_size
    assert known.tolerance == pytest.approx(min(slow, estimates.TOLERANCE * known.travel))
    bones = tuple(replace(bone, motion=None) for bone in rest.bones)
    still = replace(rest, bones=bones, attached=tuple(replace(one, bone=bones[0]) for one in rest.attached))
    assert estimates.estimates(scene, still).tolerance == pytest.approx(slow)


def scene_of(folder: Path, more: str, choice: str = "auto"):
    case = small.write(folder / "bar")
    path = case / "case.toml"
    path.write_text(f'effects = "{choice}"\n{path.read_text()}{more}')
    return casefile.read_muscle(case)


def test_a_scene_keeps_what_it_needs_and_has_the_key_of_that(tmp_path) -> None:
    light, heavy = (scene_of(tmp_path / text, WEIGHT.format(density=text)) for text in ("0.001", "100000"))
    kept = [of_case.chosen(one) for one in (light, heavy)]
    assert [len(one.effects) for one in kept] == [2, 3]
    assert [len(one.decisions) for one in kept] == [3, 3]
    listed = scene_of(tmp_path / "listed", "", "listed")
    assert kept[0].key == listed.key
    assert of_case.chosen(kept[0]) is kept[0]
    assert of_case.chosen(listed) is listed
    assert origin.changes(kept[0]) == [], "what it chose is no change of its file"
    assert "Gravity: left out" in str(kept[0].decisions[2])
    assert "Gravity: needed" in str(kept[1].decisions[2])
    assert "NeoHooke: kept, part of the material" in str(kept[0].decisions[0])


def test_explain_says_so_before_anything_is_solved(tmp_path, capsys) -> None:
    scene = scene_of(tmp_path, WEIGHT.format(density="0.001"))
    assert cli.main(["run", str(scene.folder), "--explain", "--out", str(tmp_path / "out")]) == cli.DONE
    assert "Gravity: left out, about" in capsys.readouterr().out
    assert not (tmp_path / "out").exists()


def test_bones_that_come_nowhere_near_are_left_out_and_those_that_do_are_not(tmp_path) -> None:
    """A third bone beside the bar, which rests: 1.5 mm from where that goes, and 600 mm."""
    found = []
    for away in (1.5, 600.0):
        ball = f'\n[[bone]]\nname = "ball"\nsphere = {{ centre = "5, {-away - 20}, 36 mm", radius = "20 mm" }}\n'
        scene = scene_of(tmp_path / f"{away:g}", ball + CONTACT.replace("smoothing", 'bones = ["ball"]\nsmoothing'))
        found.append(of_case.chosen(scene).decisions[-1])
    assert [one.needed for one in found] == [True, False]
    assert found[1].indicator.estimate == 0


def test_an_effect_that_turns_out_to_matter_is_added(tmp_path, monkeypatch, caplog) -> None:
    """The run goes into the ball that the guess, made blind here, did not see."""
    solved, reached = [], []

    def blind(*_) -> Near:
        return Near(1e9, 0.0, 0.0)

    def sink_in(problem, _settings, sink) -> Outcome:
        solved.append([effect.title for effect in problem.effects])
        for number in problem.frames:
            reached.append(number)
            shift = np.array([number * 3.0, 0, 0])
            sink(Frame(number, problem.surface.points + shift, problem.fibres.points + shift))
        return Outcome("converged", "done", {"seconds": 1.0})

    stand_ins.solve_by(monkeypatch, fenicsx, sink_in)
    ball = '\n[[bone]]\nname = "ball"\nsphere = { centre = "40, 0, 15 mm", radius = "20 mm" }\n'
    scene = scene_of(tmp_path, ball + CONTACT.replace("smoothing", 'bones = ["ball"]\nsmoothing'))
    with monkeypatch.context() as patch:
        patch.setattr(estimates, "_near", blind)
        bench = Bench(scene, tmp_path / "runs")
    assert [effect.title for effect in bench.scene.effects] == ["NeoHooke", "Incompressible"]
    with caplog.at_level("INFO"):
        run = bench.obtain("reference", scene.reference, "reference")
    assert solved == [["NeoHooke", "Incompressible"], ["NeoHooke", "Incompressible", "Contact"]]
    assert reached == [0, 5, *run.numbers]  # it was stopped where it met the ball
    assert "Contact: needed as it turned out at frame 5" in caplog.text
    assert "Contact" in run.origin["effects"]
    assert any(text.startswith("Contact: needed as it turned out") for text in run.origin["effects_chosen"])
    with monkeypatch.context() as patch:
        patch.setattr(estimates, "_near", blind)
        again = Bench(scene, tmp_path / "runs")
    assert again.obtain("reference", scene.reference, "reference").folder == run.folder
    assert len(solved) == 2, "what was stopped is not solved again"


def test_the_estimates_of_a_bar_are_what_is_known_of_it(tmp_path) -> None:
    scene = scene_of(tmp_path, "")
    known = estimates.estimates(scene, muscle.setup(scene))
    assert known.shear == pytest.approx(0.01, rel=1e-5)  # mu = 10 kPa; small strain
    low, high = known.stretch
    assert low < 1 < high
    assert known.acceleration >= 0
    assert known.jump > 0  # keyframes are joined by straight lines


def test_the_stretch_of_what_was_solved_is_that_of_the_surface_along_the_fibres(tmp_path) -> None:
    """The bar, made longer by a fifth along its axis, thinner, and turned."""
    scene = scene_of(tmp_path, "")
    rest = muscle.setup(scene)
    first, last = (rest.surface.points[entry.vertices].mean(axis=0) for entry in rest.attached)
    axis = (last - first) / np.linalg.norm(last - first)
    stretched = np.outer(axis, axis) * 1.2 + (np.eye(3) - np.outer(axis, axis)) * 1.2**-0.5
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    low, high = estimates.stretched(rest, rest.surface.points @ (turn @ stretched).T)
    # Triangles whose plane is off the axis by the slope of the bar, up to a few per cent, mix in what is thinner, to second order.
    assert high == pytest.approx(1.2, abs=1e-3)
    assert low > 1.1
    assert estimates.stretched(rest, rest.surface.points) == pytest.approx((1, 1))


def test_fibres_that_were_stretched_after_all_are_added(tmp_path) -> None:
    """They are slack up to more than is guessed of the turn, and the run stretched them by more than that."""
    scene = of_case.chosen(scene_of(tmp_path, small.FIBRES.format(slack=1.3)))
    rest = muscle.setup(scene)
    assert ["FibrePassive: left out" in str(one) for one in scene.decisions] == [False, False, True]
    still, longer = rest.surface.points, rest.surface.points * 1.6
    watch = of_case.watch(scene, rest, lambda: None)
    assert watch.see(0, still, None) == ()
    (late,) = watch.see(10, longer, None)
    assert "FibrePassive: needed as it turned out at frame 10" in str(late)


def added_later(folder: Path, monkeypatch: pytest.MonkeyPatch, text: str, blind: str, unseen: object):
    """The run of a scene with a ``text`` whose guess is ``blind``, the same with all effects from the start, and the bench of the
    former: the bar bends the other way first, up to frame 5.
    """
    if not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")):
        pytest.skip("FEniCSx is not installed")
    found = []
    for choice in ("auto", "listed"):
        path = scene_of(folder / choice, text, choice).folder / "case.toml"
        bent = path.read_text().replace('{ frame = 0, angle = "0 rad" }', BACK)
        path.write_text(bent.replace("every = 5", "every = 2"))
        scene = casefile.read_muscle(path.parent)
        with monkeypatch.context() as patch:
            patch.setattr(estimates, blind, lambda *_: unseen)
            bench = Bench(scene, folder / f"runs of {choice}")
        found += [bench.obtain("reference", scene.reference, "reference"), bench]
    run, bench, whole, _ = found
    return run, whole, bench


BALL = '\n[[bone]]\nname = "ball"\nsphere = { centre = "5, -5.5, 30 mm", radius = "4 mm" }\n'
LATER = {
    "contact": (BALL + CONTACT.replace("smoothing", 'bones = ["ball"]\nsmoothing'), "_near", Near(1e9, 0.0, 0.0)),
    "slack fibres": (small.FIBRES.format(slack=1.06), "_stretch", (1.0, 1.0)),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", LATER)
def test_a_run_goes_on_with_what_turned_out_to_matter_from_the_last_good_frame(kind, tmp_path, monkeypatch) -> None:
    """What comes out is what is solved with all effects from the start."""
    run, whole, bench = added_later(tmp_path, monkeypatch, *LATER[kind])
    assert whole.outcome.status == run.outcome.status == "converged"
    assert run.folder.name == whole.folder.name, "a run with the effect, whenever it was added"
    assert run.numbers == whole.numbers
    assert run.positions == pytest.approx(whole.positions, abs=1e-6)
    good = int(run.outcome.message.rpartition("effects were added, from frame ")[2].split()[0])
    (turned_out,) = (one.turned_out for one in bench.scene.decisions if one.turned_out is not None)
    assert 0 < good < turned_out
    if kind == "contact":
        areas = whole.scalars["contact_area"]
        assert areas[list(run.numbers).index(good)] == 0 < areas[list(run.numbers).index(turned_out)]
