"""An error bar is asked for by the command line, made of runs on other sizes and with finer numerics, and kept beside its run."""

import json
import logging
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small
import stand_ins

from fem_reference import cli, metrics, report
from fem_reference.assessment import error_bars
from fem_reference.effects import make as make_effect
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import vertex_areas
from fem_reference.problems import muscle as meshing
from fem_reference.report import pages
from fem_reference.runs.store import Frame, Outcome
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import fenicsx, recorded
from fem_reference.solvers.common.load_steps import Attempt, StepSizes, march
from fem_reference.solvers.fenicsx import Settings
from fem_reference.studies import refinement, variations
from fem_reference.studies.execution import Bench
from fem_reference.studies.variations import on_larger

pytestmark = pytest.mark.slow

CONTACT = '\n[[effect]]\nname = "contact"\nstiffness = "100 kPa/mm"\nsmoothing = "0.2 mm"\n'
VISCOSITY = '\n[[effect]]\nname = "viscosity"\neta = "1 kPa s"\n'
CONTACT_GIVES = 1e-5
WRITE, PAGE = pages.write, report.of_comparison


def growth(tets: float) -> float:
    """What so many tetrahedra add to the growth of a frame number."""
    return 6e-7 * tets


def swell(problem, _settings, sink) -> Outcome:
    """In place of the reference: all points move away from the origin, by more the more tets and the softer contact."""
    give = 0 if problem.contact is None else CONTACT_GIVES * 0.1 / problem.contact.stiffness
    for number in problem.frames:
        factor = 1 + number * (growth(problem.mesh_facts["tets"]) + give)
        sink(Frame(number, problem.surface.points * factor, problem.fibres.points * factor))
    return Outcome("converged", "done", {"seconds": 1.0})


@pytest.fixture
def case(tmp_path, monkeypatch) -> Path:
    """The small scene, solved by ``swell``, without its page."""
    stand_ins.solve_by(monkeypatch, fenicsx, swell)
    stand_ins.unchecked(monkeypatch)
    monkeypatch.setattr(report, "of_comparison", lambda _: None)
    monkeypatch.setattr(pages, "write", lambda _, folder, *__: folder)
    return small.write(tmp_path / "bar")


def call(case: Path, *words: str):
    out = case.parent / "out"
    target = out / "facts.json"
    target.unlink(missing_ok=True)
    status = cli.main([words[0], str(case), *words[1:], "--out", str(out), "--json", str(target), "--quiet"])
    return status, json.loads(target.read_text()) if target.exists() else None


def rows(facts, of, metric, statistic):
    found = [
        row for row in facts["error_bars"] if (row["of"], row["metric"], row["statistic"]) == (of, metric, statistic)
    ]
    return np.array([row["value"] for row in found])


def scene_of(case: Path, more: str = "") -> MuscleCase:
    path = case / "case.toml"
    path.write_text(path.read_text() + more)
    return casefile.read_muscle(case)


@pytest.mark.usefixtures("undrawn")
def test_the_bar_covers_an_error_that_is_known(case, capsys, monkeypatch) -> None:
    monkeypatch.setattr(report, "of_comparison", PAGE)
    monkeypatch.setattr(pages, "write", WRITE)
    path = case / "case.toml"
    path.write_text(path.read_text() + CONTACT)
    status, facts = call(case, "run")
    assert (status, facts["error_bars"], facts["verdicts"][0]["error_bar"]) == (cli.VERDICT_FAIL, [], None)  # it swells
    page = case.parent / "out" / "bar-reference" / "report.html"
    assert "With <code>--error-bar</code> the reference is also solved" in page.read_text()
    status, facts = call(case, "run", "--error-bar")
    assert (status, facts["verdict"]) == (cli.DONE, "inconclusive")
    scene = casefile.read_muscle(case)
    bench = Bench(scene, case.parent / "out" / "runs")
    fine, coarse = bench.problem(), refinement.coarser(bench)[0].problem()
    tets = [built.mesh_facts["tets"] for built in (fine, coarse)]
    surface = fine.surface
    areas = vertex_areas(surface.points, surface.triangles)
    furthest = metrics.rms(np.linalg.norm(surface.points, axis=1)[None], areas)[0]
    # Of order 1.5 in tetrahedra 1.5 times as large, and as much more as 6 mm is above the radius of an end of 100 mm2. Twice the
    # stiffness takes half of what contact gives away, twice that is all.
    left = 1.25 / (1.5**1.5 - 1) * 6 / np.sqrt(100 / np.pi)
    share = np.hypot(left * (growth(tets[0]) - growth(tets[1])), CONTACT_GIVES)
    wanted = np.array([0, 5, 10, 15, 20]) * furthest * share
    assert rows(facts, "change", "surface_deviation", "rms") == pytest.approx(wanted, rel=1e-6)
    assert "error bars of the reference" in capsys.readouterr().out
    text = page.read_text()
    assert "(9 mm instead of 6 mm)" in text
    assert "source of error halved at a time (contact stiffness, contact smoothing and distances to bones)" in text
    assert ">error bar</text>" in text


@pytest.mark.parametrize(("size", "more"), [(5.0, 1.0), (40.0, 4.0)])
def test_tetrahedra_larger_than_the_radius_of_an_attachment_make_bars_longer(case, monkeypatch, size, more) -> None:
    monkeypatch.setattr(refinement, "attached_area", lambda *_: np.pi * 10.0**2)  # [mm2]
    scene = scene_of(case)
    muscle = scene.muscle.model_copy(update={"tet_size": size})
    bench = Bench(scene.model_copy(update={"muscle": muscle}), case.parent / "out" / "runs")
    assert refinement.safety(bench) == pytest.approx(error_bars.SAFETY * more)


def test_it_is_kept_with_its_run_until_the_metrics_change_or_the_file_is_damaged(case, monkeypatch, capsys) -> None:
    call(case, "run", "--error-bar")
    first = rows(call(case, "compare")[1], "deviation", "surface_deviation", "rms")
    assert (first[1:] > 0).all()
    monkeypatch.setattr(refinement, "_measuring_hash", lambda: "others")
    assert call(case, "run")[1]["error_bars"] == []
    (path,) = (case.parent / "out" / "runs").glob(f"*/{error_bars.FILE}")
    path.write_text("{")
    capsys.readouterr()
    assert call(case, "run")[0] == cli.BAD_INPUT
    assert "error_bar.json: got Expecting property name" in capsys.readouterr().err
    monkeypatch.setattr(meshing, "tetrahedralise", lambda *_: pytest.fail("stored runs need no mesh"))
    again = rows(call(case, "run", "--error-bar")[1], "deviation", "surface_deviation", "rms")
    assert np.array_equal(again, first)


def test_bars_are_stale_as_soon_as_code_that_decides_their_numbers_changes() -> None:
    """The bars of several muscles, the variations and the part of a run for each muscle, beside the bars themselves."""
    assert all(path.is_file() for path in refinement.MAKING)
    makers = {"muscle_bars", "refinement", "variations", "views", "error_bars", "force_bars", "differences"}
    makers |= {"second_check", "run_checks", "neighbours"}
    assert {path.stem for path in refinement.MAKING} == makers


def test_the_judge_takes_the_bar_on_both_sides_of_the_value(case) -> None:
    path, within = case / "case.toml", "0.5 %"
    verdict = call(case, "run", "--error-bar")[1]["verdicts"][0]
    bar, value = verdict["error_bar"], abs(verdict["value"])
    for allowed, word in ((value - 1.01 * bar, "fail"), (value, "inconclusive"), (value + 1.01 * bar, "pass")):
        other = f"{max(allowed, 0.0)} %"
        path.write_text(path.read_text().replace(f'"{within}"', f'"{other}"'))
        assert call(case, "run")[1]["verdict"] == ("inconclusive" if allowed < 0 else word)
        within = other


def test_progress_says_which_run_and_how_many(case, caplog) -> None:
    caplog.set_level(logging.INFO, logger="fem_reference")
    bench = Bench(casefile.read_muscle(case), case.parent / "runs")
    assert refinement.obtain(bench, bench.obtain("reference", bench.scene.reference, "reference")) is not None
    assert "error bar: run 1 of 1, tetrahedra of 9 mm; about" in caplog.text


def test_a_run_that_failed_has_none(case, monkeypatch) -> None:
    def fail(problem, _settings, sink) -> Outcome:
        sink(Frame(0, problem.surface.points, problem.fibres.points))
        return Outcome("diverged", "no")

    stand_ins.solve_by(monkeypatch, fenicsx, fail)
    stand_ins.unchecked(monkeypatch)
    status, facts = call(case, "run", "--error-bar")
    assert (status, facts["error_bars"]) == (cli.SOLVER_FAILED, [])


@pytest.mark.parametrize("denied", [False, True])
def test_a_coarser_run_that_fails_has_bars_at_the_frames_that_it_reached_unless_denied(
    case, monkeypatch, denied
) -> None:
    finest = []

    def fail(problem, settings, sink) -> Outcome:
        finest.append(problem.mesh_facts["tets"])
        whole = problem.mesh_facts["tets"] == finest[0]
        swell(problem, settings, lambda frame: sink(frame) if whole or frame.number <= 10 else None)
        return Outcome("converged" if whole else "diverged", "so it ended")

    stand_ins.solve_by(monkeypatch, fenicsx, fail)
    if denied:
        stand_ins.deny_further_runs(monkeypatch)
    _, facts = call(case, "run", "--error-bar")
    values = rows(facts, "change", "surface_deviation", "max")
    assert [value is None for value in values[1:]] == [denied, denied, True, True]
    assert (facts["verdict"], facts["verdicts"][0]["error_bar"]) == ("inconclusive", None)


def test_further_runs_that_the_second_check_denies_give_no_bar(case, monkeypatch) -> None:
    stand_ins.deny_further_runs(monkeypatch)
    _, facts = call(case, "run", "--error-bar")
    assert {row["value"] for row in facts["error_bars"] if row["frame"] > 0} == {None}
    assert (facts["verdict"], facts["verdicts"][0]["error_bar"]) == ("inconclusive", None)


@pytest.mark.parametrize("changes", [{}, {"attachment[0].stiffness": "100 kPa/mm"}])
def test_bars_know_whether_an_attachment_is_by_springs(case, monkeypatch, changes) -> None:
    pairs, make = [], error_bars.error_bars
    monkeypatch.setattr(error_bars, "error_bars", lambda pair, context: pairs.append(pair) or make(pair, context))
    bench = Bench(casefile.read_muscle(case, changes=changes), case.parent / "runs")
    reference = bench.obtain("reference", bench.scene.reference, "reference")
    for model in (True, False):
        refinement.obtain(bench, reference, model=model)
    assert [pair.springs for pair in pairs] == [bool(changes)] * 2
    assert [pair.exact is not None for pair in pairs] == [bool(changes), False]


def test_a_change_by_exact_attachments_that_cannot_be_solved_is_not_known(case, monkeypatch, caplog) -> None:
    """A load on what springs attach is such a case: on exact attachments it is refused."""
    monkeypatch.setattr(refinement, "exactly_attached", lambda one: on_larger(one, 10.0))
    scene = casefile.read_muscle(case, changes={"attachment[0].stiffness": "100 kPa/mm"})
    bench = Bench(scene, case.parent / "runs")
    bars = refinement.obtain(bench, bench.reference())
    assert (
        "error bar: the change due to exact attachments is not known: error bar, exact attachments: got" in caplog.text
    )
    bar = refinement.stored(bench.reference()).find("change", "surface_deviation", "rms")
    assert np.isnan(bar.model).all()
    assert np.isfinite(bar.values).all()
    assert all(np.isnan(one.model).all() for one in bars.bars if one.metric == "force_on_bone")
    assert bars.sizes == (6.0, 9.0)


def test_sizes_that_make_no_other_mesh_are_refused(case, monkeypatch) -> None:
    monkeypatch.setattr(refinement, "RATIOS", (1.0,))
    bench = Bench(casefile.read_muscle(case), case.parent / "runs")
    reference = bench.obtain("reference", bench.scene.reference, "reference")
    with pytest.raises(
        InputError, match=r"muscle.tet_size: got meshes of .* tetrahedra, want a size that can be coarsened"
    ):
        refinement.obtain(bench, reference)


def test_a_scene_that_cannot_be_coarser_is_named(case, monkeypatch) -> None:
    monkeypatch.setattr(refinement, "RATIOS", (10.0, 20.0))
    bench = Bench(casefile.read_muscle(case), case.parent / "runs")
    reference = bench.obtain("reference", bench.scene.reference, "reference")
    with pytest.raises(InputError, match=r"error bar, larger tetrahedra: got a scene that cannot be set up"):
        refinement.obtain(bench, reference)


@pytest.mark.parametrize(("cores", "ranks", "at_once"), [(2, None, 2), (2, 2, 1), (4, 2, 2)])
def test_two_runs_are_solved_at_a_time_where_there_are_cores(case, monkeypatch, cores, ranks, at_once) -> None:
    """On larger tetrahedra and with three changes of contact: with two at a time, two meet at a barrier, twice."""
    monkeypatch.setattr(refinement.os, "sched_getaffinity", lambda _: set(range(cores)))
    barrier, asked = threading.Barrier(at_once, timeout=30), list[int | None]()

    def solve(problem, settings, sink) -> Outcome:
        asked.append(settings.ranks)
        if len(asked) > 1:  # the first is the reference
            barrier.wait()
        return swell(problem, settings, sink)

    stand_ins.solve_by(monkeypatch, fenicsx, solve)
    bench = Bench(scene_of(case, CONTACT), case.parent / "runs", ranks)
    assert refinement.obtain(bench, bench.reference()) is not None
    assert asked == [ranks, *4 * [(ranks or 1) if at_once == 2 else ranks]]


def test_tetrahedra_are_larger_by_the_next_ratio_where_the_first_cannot_be_set_up(case, monkeypatch) -> None:
    monkeypatch.setattr(refinement, "RATIOS", (10.0, 1.5))
    bench = Bench(casefile.read_muscle(case), case.parent / "runs")
    bars = refinement.obtain(bench, bench.reference())
    assert bars.sizes == (6.0, 9.0)
    assert np.isfinite(bars.find("change", "surface_deviation", "rms").values).all()


@pytest.mark.parametrize("words", [("run", "--solver", "pbd"), ("run",), ("compare",)])
def test_it_is_of_the_reference_of_a_muscle(case, capsys, words) -> None:
    name = str(case) if "--solver" in words else "rod"
    assert cli.main([words[0], name, *words[1:], "--error-bar", "--out", str(case.parent / "out")]) == cli.BAD_INPUT
    got, want = ("another solver", "the reference") if "--solver" in words else ('"rod", a scalar case', "the case")
    assert f"--error-bar: got {got}, want {want} of a muscle" in capsys.readouterr().err


@pytest.mark.parametrize(("every", "largest"), [(10, None), (9, 4.0), (1, None)])
def test_load_steps_are_at_most_half_as_long(case, every, largest) -> None:
    scene = scene_of(case)
    frames = scene.frames.model_copy(update={"last": 90, "every": every})
    settings = Settings(first_step=5.0, largest_step=largest)
    changed = variations.with_half_steps(scene.model_copy(update={"frames": frames}), settings)(
        scene
    ).reference.settings
    taken = [0.0]
    list(
        march(
            lambda at: taken.append(at) or Attempt("converged", 2),
            frames.numbers,
            StepSizes(changed["first_step"], 0.1, changed["largest_step"]),
        )
    )
    assert max(np.diff(taken)) <= min(every, largest or every) / 2
    assert set(frames.numbers) <= set(taken)


def test_load_steps_are_varied_where_time_matters(case) -> None:
    assert refinement.variations(scene_of(case), Settings()) == {}
    path = case / "case.toml"
    path.write_text(path.read_text().replace("every = 5", 'every = 5\ninterval = "20 ms"'))
    timed = scene_of(case, VISCOSITY)
    assert list(refinement.variations(timed, Settings())) == ["load steps"]
    assert refinement.variations(timed, recorded.RecordedSettings(folder="frames", unit="mm")) == {}


def test_where_no_bone_pressed_contact_has_no_error(case) -> None:
    scene = scene_of(case, CONTACT)
    assert refinement.variations(scene, Settings(), pressed=False) == {}
    bench = Bench(scene, case.parent / "runs")
    reference = bench.obtain("reference", scene.reference, "reference")
    assert len(refinement.needed(bench, reference)) == 3
    for area, count in ((0.0, 0), (2.0, 3)):
        pressed = replace(reference, scalars={"contact_area": np.array([0.0, area, 0, 0, np.nan])})
        assert len(refinement.needed(bench, pressed)) == count


def test_a_bar_that_is_cheap_is_made_without_being_asked_for(case) -> None:
    # Nested, larger tetrahedra are an eighth: one run of them costs less than a fifth; those of a mesh of its own cost more.
    path = case / "case.toml"
    _, facts = call(case, "run")
    assert facts["error_bars"] == []
    path.write_text(path.read_text().replace('tet_size = "6 mm"', 'tet_size = "6 mm"\nrefinements = 1'))
    _, facts = call(case, "run")
    assert len(facts["error_bars"]) > 0
    assert {row["model"] for row in facts["error_bars"]} == {None}
    path.write_text(path.read_text() + CONTACT)
    assert call(case, "run")[1]["error_bars"] == [], "with contact it takes four runs"


def test_the_coarse_member_of_a_pair_has_the_tetrahedra_before_their_last_refinement(case) -> None:
    scene = scene_of(case)
    nested = scene.model_copy(update={"muscle": scene.muscle.model_copy(update={"refinements": 2})})
    coarser, ratio = refinement.coarser(Bench(nested, case.parent / "runs"))
    assert (coarser.scene.muscle.refinements, ratio) == (1, 2.0)
    coarser, ratio = refinement.coarser(Bench(scene, case.parent / "runs"))
    assert (coarser.scene.muscle.tet_size, ratio) == (9.0, 1.5)


def test_contact_is_varied_cause_by_cause(case) -> None:
    scene = scene_of(case, CONTACT)
    varied = {name: vary(scene) for name, vary in refinement.variations(scene, Settings(first_step=5.0)).items()}
    assert list(varied) == ["contact stiffness", "contact smoothing", "distances to bones"]
    assert [effect.stiffness for effect in varied["contact stiffness"].effects[2:]] == [pytest.approx(0.2)]
    assert [effect.smoothing for effect in varied["contact smoothing"].effects[2:]] == [pytest.approx(0.1)]
    assert varied["contact stiffness"].effects[:2] == scene.effects[:2]
    assert [bone.distance_error for bone in varied["distances to bones"].bone] == [0.025, 0.025]
    assert [bone.distance_rounding for bone in varied["distances to bones"].bone] == [0.5, 0.5]
    # Each is another scene with another key, or has other settings: no run is mistaken for another.
    keys = {changed.key for changed in varied.values()}
    assert len(keys | {scene.key}) == 4


def test_a_finer_scene_has_every_cause_of_error_halved(case) -> None:
    scene = scene_of(case, CONTACT)
    bench = Bench(scene, case.parent / "runs")
    reference = bench.obtain("reference", scene.reference, "reference")
    finer = refinement.finer(bench, reference, 0.8)
    (contact,) = finer.effects[2:]
    assert (finer.muscle.tet_size, contact.stiffness, contact.smoothing) == pytest.approx((4.8, 0.2, 0.1))
    assert [bone.distance_rounding for bone in finer.bone] == [0.5, 0.5]
    unpressed = replace(reference, scalars={"contact_area": np.zeros(5)})
    assert refinement.finer(bench, unpressed, 0.8).effects == scene.effects


def test_with_friction_a_state_depends_on_load_steps() -> None:
    case = casefile.read("hip_flexion")
    laws = [one.model_copy(update={"friction": 0.3}) if one.title == "Contact" else one for one in case.effect]
    rubbed = case.model_copy(update={"effect": tuple(laws)})
    assert "load steps" not in refinement.variations(case, Settings())
    assert "load steps" in refinement.variations(rubbed, Settings())
    assert "load steps" not in refinement.variations(rubbed, Settings(), pressed=False)


def test_contact_of_a_muscle_with_itself_is_a_cause_of_error_where_it_touched() -> None:
    case = casefile.read("hip_flexion")
    law = make_effect("touching", stiffness=0.1, smoothing=0.1)
    case = case.model_copy(update={"effect": (*case.effect, law)})
    own = {"contact with itself stiffness", "contact with itself smoothing"}
    assert own <= set(refinement.variations(case, Settings()))
    assert not own & set(refinement.variations(case, Settings(), touched=False))
