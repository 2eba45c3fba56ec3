"""``effects = "auto"``: indicators of effects, and runs to which what turns out to matter is added while they are made."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small
import stand_ins
from acting import PARAMETERS
from auto_scenes import CONTACT, WEIGHT, scene_of

from fem_reference import cli, effects
from fem_reference.effects import make
from fem_reference.foundations.indicators import Estimates, Near
from fem_reference.problems import estimates
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
BACK = '{ frame = 0, angle = "0 rad" }, { frame = 5, angle = "-0.2 rad" }'


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


def test_explain_says_so_before_anything_is_solved(tmp_path, capsys) -> None:
    scene = scene_of(tmp_path, WEIGHT.format(density="0.001"))
    assert cli.main(["run", str(scene.folder), "--explain", "--out", str(tmp_path / "out")]) == cli.DONE
    assert "Gravity: left out, about" in capsys.readouterr().out
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
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
    with caplog.at_level("INFO", logger="fem_reference"):
        run = bench.obtain("reference", scene.reference, "reference")
    assert solved == [["NeoHooke", "Incompressible"], ["NeoHooke", "Incompressible", "Contact"]]
    assert reached == [0, 5, *run.numbers]  # it was stopped where it met the ball
    assert "Contact: found to be needed at frame 5" in caplog.text
    assert "Contact" in run.origin["effects"]
    assert any(text.startswith("Contact: found to be needed") for text in run.origin["effects_chosen"])
    with monkeypatch.context() as patch:
        patch.setattr(estimates, "_near", blind)
        again = Bench(scene, tmp_path / "runs")
    assert again.obtain("reference", scene.reference, "reference").folder == run.folder
    assert len(solved) == 2, "what was stopped is not solved again"


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
