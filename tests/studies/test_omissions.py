"""The verb ``effects``: what is left out and what never, what counts as mattering, and the page; a failure is a row of it."""

import json
import math
from pathlib import Path

import pytest
import small
import stand_ins

from fem_reference import cli
from fem_reference.assessment.omissions import Ablation, CaseOmissions, Omission
from fem_reference.effects import make
from fem_reference.runs.store import Frame, Outcome
from fem_reference.scenes import casefile
from fem_reference.scenes.case import SolverChoice
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx.processes import installed
from fem_reference.studies import omissions
from fem_reference.studies.omissions import LeftOut
from fem_reference.studies.variations import Trial

GRAVITY = """
[[effect]]
name = "gravity"
density = "1060 kg/m3"
acceleration = "0, 0, {g} m/s2"
ramp = [{{ frame = 0, amount = 0 }}, {{ frame = 5, amount = 1 }}]
"""
CONTACT = '\n[[effect]]\nname = "contact"\nstiffness = "100 kPa/mm"\nsmoothing = "0.2 mm"\n'
FIBRES = small.FIBRES.format(slack=1.0)
XPBD = {"solver": "xpbd", "sub_steps": 2, "frame_time": "20 ms", "density": "1060 kg/m3"}


def scene_in(folder: Path, more: str = "") -> MuscleCase:
    """The small scene with ``more`` in its file."""
    path = small.write(folder) / "case.toml"
    path.write_text(path.read_text() + more)
    return casefile.read_muscle(folder)


# What is left out


def test_each_effect_but_the_material_is_left_out_in_turn_and_then_all(tmp_path) -> None:
    scene = scene_in(tmp_path / "bar", GRAVITY.format(g=-9.81) + CONTACT + FIBRES)
    found = omissions.parts(Trial(scene, scene.reference, "reference"))
    single = [("gravity",), ("contact",), ("fibre_passive",)]
    assert [part.names for part in found] == [*single, ("gravity", "contact", "fibre_passive")]
    assert [omissions.name_of(effect) for effect in scene.effects if omissions.is_material(effect)] == [
        "neo_hooke",
        "incompressible",
    ]


def test_a_scene_of_its_material_alone_has_nothing_to_leave_out(tmp_path) -> None:
    scene = scene_in(tmp_path / "bar")
    assert omissions.parts(Trial(scene, scene.reference, "reference")) == ()
    fibres = scene.model_copy(update={"effect": (make("guccione", c="1 kPa", bf=8.0, bt=2.0, bfs=4.0),)})
    assert omissions.parts(Trial(fibres, scene.reference, "reference")) == ()  # nothing elastic would be left


def test_what_is_left_is_the_scene_that_one_would_write_without_it(tmp_path) -> None:
    scene = scene_in(tmp_path / "bar", GRAVITY.format(g=-9.81) + CONTACT)
    written = scene_in(tmp_path / "written", CONTACT)
    (gravity, *_) = omissions.parts(Trial(scene, scene.reference, "reference"))
    trial = omissions.without(Trial(scene, scene.reference, "reference"), gravity)
    assert trial.scene.key == written.key
    assert (trial.choice, trial.label) == (scene.reference, "reference, without = gravity")


TENSE = """
[[effect]]
name = "in_situ"
stretch = 1.1
"""
TONE = """
[[effect]]
name = "fibre_active"
stress = "300 kPa"
optimal_stretch = 1.0
ramp = [{{ frame = 0, amount = {tone} }}, {{ frame = 5, amount = 0.5 }}]
"""


@pytest.mark.parametrize(("tone", "support"), [(0.05, True), (0.05, False), (0.0, True)])
def test_with_tension_at_rest_goes_what_only_that_balances(tmp_path, tone, support) -> None:
    """Without it a tone at the first frame and bones that support the muscle are no rest: a scene that is refused when read."""
    active, bones = TONE.format(tone=tone), CONTACT + ('support = "3 mm"\n' if support else "")
    scene = scene_in(tmp_path / "bar", TENSE + active + bones + GRAVITY.format(g=-9.81))
    trial = Trial(scene, scene.reference, "reference")
    also = (*(["fibre_active"] if tone else []), *(["support of contact"] if support else []))
    parts = omissions.parts(trial)
    singles = [("fibre_active",), ("contact",), ("gravity",)]
    every = ("in_situ", "fibre_active", "contact", "gravity", *(["support of contact"] if support else []))
    assert [part.names for part in parts] == [("in_situ", *also), *singles, every]
    written = scene_in(tmp_path / "written", ("" if tone else active) + CONTACT + GRAVITY.format(g=-9.81))
    assert omissions.without(trial, parts[0]).scene.key == written.key
    for part in parts[1:4]:
        kept = omissions.without(trial, part).scene.effects
        assert scene.effects[2] in kept  # the tension
        assert part.names == ("contact",) or any(getattr(one, "support", None) for one in kept) == support


def test_what_is_all_is_left_out_once(tmp_path) -> None:
    scene = scene_in(tmp_path / "bar", TENSE + TONE.format(tone=0.05))
    parts = omissions.parts(Trial(scene, scene.reference, "reference"))
    assert [part.names for part in parts] == [("in_situ", "fibre_active"), ("fibre_active",)]


def test_an_element_has_a_pressure_only_as_long_as_an_effect_brings_it(tmp_path) -> None:
    matrix, volume, penalty = (
        make("neo_hooke", mu="10 kPa"),
        make("incompressible", bulk="1 MPa"),
        make("incompressible_penalty", bulk="1 MPa"),
    )
    assert omissions.fitting("P2/P1", (matrix, volume)) == "P2/P1"
    assert omissions.fitting("P2/P1", (matrix, penalty)) == "P2"
    assert omissions.fitting("Q1/P0", (matrix,)) == "Q1"
    assert omissions.fitting("P1", (matrix, volume)) == "P1/P1"
    assert omissions.fitting("Q1/P0", (matrix, volume)) == "Q1/P0"
    scene = scene_in(tmp_path / "bar")
    part = LeftOut({"incompressible": scene.effects[1]})
    trial = omissions.without(Trial(scene, scene.reference, "reference"), part)
    assert (trial.choice.settings["element"], trial.changed) == ("P2", {"element": "P2"})


def test_features_of_a_candidate_are_its_optional_settings_that_are_no_numerics(tmp_path) -> None:
    scene = scene_in(tmp_path / "bar")
    chosen = SolverChoice(**XPBD, volume="1 MPa", damping=None, collision={"gap": "0 mm"})
    assert omissions.features(chosen, "xpbd") == ("volume", "collision")
    names = [part.names for part in omissions.parts(Trial(scene, chosen, "xpbd"))]
    assert names == [("volume",), ("collision",), ("volume", "collision")]
    trial = omissions.without(Trial(scene, chosen, "xpbd"), LeftOut({}, ("volume",)))
    assert set(trial.choice.settings) == set(chosen.settings) - {"volume"}
    numerics = SolverChoice(
        solver="fenicsx", largest_step=2.0, quadrature_degree=4, time_limit="9 s", precision="double"
    )
    assert omissions.features(numerics, "fenicsx") == ()


def omission(*left_out: str, rms: float = 1.0, seconds: float = 4.0, **more) -> Omission:
    changes = {
        "volume.deviation": 0.0,
        "fibre_length.rms_percent": 0.0,
        "surface_deviation.rms": rms,
        "surface_deviation.max": rms,
    }
    costs = {
        "seconds_processor": 99.0,
        "seconds_processor_solve": seconds,
        "seconds_solve": 2 * seconds,
        "seconds_contact": 0.5 * seconds,
        "unknowns": 500.0,
    }
    return Omission(left_out, "converged", "", changes if left_out else {}, costs, **more)


def found(*more: Omission) -> CaseOmissions:
    rows = (
        omission("contact", rms=3.0, seconds=4.0, predicted={"surface_deviation.rms": 2.5}),
        omission("gravity", rms=0.01, seconds=9.0),
        *more,
    )
    whole = Ablation("reference", "fenicsx", ("neo_hooke",), omission(seconds=10.0), rows)
    units = {name: "%" if "percent" in name or "volume" in name else "mm" for name in rows[0].changes}
    return CaseOmissions("hip", "The hip", (whole,), units, dict.fromkeys(units, 0.3), "", {"machine": "here"})


def test_time_is_without_compilation_and_phases_are_shares_of_it() -> None:
    one = omission("contact", seconds=4.0)
    assert (one.seconds, one.phase("contact")) == (4.0, 1.0)  # a quarter of the time of solving
    assert math.isnan(one.phase("linear systems"))
    assert found().ablations[0].relative(one.seconds) == pytest.approx(0.4)


# The verb


def call(case: Path, *words: str):
    """The exit status of the verb, and what it wrote as JSON."""
    target = case.parent / "facts.json"
    status = cli.main(
        ["effects", str(case), *words, "--out", str(case.parent / "out"), "--json", str(target), "--quiet"]
    )
    return status, json.loads(target.read_text()) if target.exists() else None


limits: list[float | None] = []


def sag(problem, settings, sink) -> Outcome:
    """In place of the reference: gravity stretches by 1 % a frame number, tetrahedra by little, and fibres keep it together."""
    limits.append(settings.time_limit)
    names = [omissions.name_of(effect) for effect in problem.effects]
    for number in problem.frames:
        if number > 10 and "fibre_passive" not in names:
            return Outcome("diverged", "it fell apart", {"seconds": 1.0})
        factor = 1 + number * (0.01 * ("gravity" in names) + 1e-7 * problem.mesh_facts["tets"])
        sink(Frame(number, problem.surface.points * factor, problem.fibres.points * factor))
    seconds = 4.0 if "gravity" in names else 3.0
    return Outcome("converged", "done", {"seconds": 5.0, "seconds_processor": seconds, "newton_iterations": 7.0})


@pytest.mark.slow
def test_the_verb_measures_what_each_effect_changes_once(tmp_path, monkeypatch) -> None:
    limits.clear()
    stand_ins.solve_by(monkeypatch, fenicsx, sag)
    stand_ins.unchecked(monkeypatch)
    case = small.write(tmp_path / "bar")
    scene_in(case, GRAVITY.format(g=-9.81) + FIBRES)
    status, facts = call(case)
    assert status == cli.DONE
    reference, *candidates = facts["ablations"]
    assert candidates == []  # pbd has no optional features here
    assert reference["kept"] == ["neo_hooke", "incompressible"]
    rows = {" ".join(row["left_out"]): row for row in reference["omissions"]}
    assert list(rows) == ["gravity", "fibre_passive", "gravity fibre_passive"]
    # By hand: lengths are 20 % longer at the last frame, 20 of the unit; so is every place.
    assert rows["gravity"]["changes"]["fibre_length.rms_percent"] == pytest.approx(20.0, rel=1e-6)
    assert rows["gravity"]["verdict"] == "matters"
    assert (rows["fibre_passive"]["status"], rows["fibre_passive"]["message"]) == ("diverged", "it fell apart")
    assert (rows["fibre_passive"]["changes"], rows["fibre_passive"]["verdict"]) == ({}, "not known")
    assert limits[:2] == [None, pytest.approx(2 * 5.0 + omissions.COMPILING)]
    assert "it fell apart" in (tmp_path / "out" / "bar" / "effects.html").read_text(encoding="utf-8")
    count = len(limits)
    assert call(case) == (status, facts)
    assert len(limits) == count  # all of it is in the store, what failed too


@pytest.mark.slow
def test_nothing_is_left_out_of_a_reference_that_fails(tmp_path, monkeypatch, capsys) -> None:
    stand_ins.solve_by(monkeypatch, fenicsx, sag)
    stand_ins.unchecked(monkeypatch)
    case = small.write(tmp_path / "bar")
    scene_in(case, GRAVITY.format(g=-9.81))
    status, facts = call(case)
    assert status == cli.SOLVER_FAILED
    assert facts["ablations"][0]["omissions"] == []
    assert "because the complete run did not converge (diverged): it fell apart" in capsys.readouterr().out


def test_fewer_workers_than_one_are_refused(capsys) -> None:
    assert cli.main(["effects", "hip_flexion", "--workers", "0", "--quiet"]) == cli.BAD_INPUT
    assert "--workers: got 0, want 1 or more" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.skipif(not installed(), reason="FEniCSx is not installed")
def test_an_effect_of_no_strength_changes_nothing_and_weight_changes_something(tmp_path) -> None:
    for g, matters in (("0", False), ("-9.81", True)):
        case = small.write(tmp_path / f"bar_{matters}")
        scene_in(case, GRAVITY.format(g=g))
        _, facts = call(case)
        (row,) = facts["ablations"][0]["omissions"]
        assert (row["status"], row["left_out"]) == ("converged", ["gravity"])
        if matters:
            assert row["changes"]["surface_deviation.max"] > 0.01  # [mm]
        else:  # to the tolerance of the solver
            assert max(row["changes"].values()) < 1e-5
            assert row["verdict"] == "does not matter"
