"""Hard cases: every folder is whole, runs become verdicts and never tracebacks, and what explodes is found out."""

import json
import time
from dataclasses import replace

import numpy as np
import pytest
import stand_ins

from fem_reference import cli
from fem_reference.assessment import health, stress
from fem_reference.assessment.stress import Bound, Cell, History
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import tet_volumes
from fem_reference.geometry import skins
from fem_reference.runs.store import Outcome
from fem_reference.scenes.case import SolverChoice
from fem_reference.solvers import fenicsx
from fem_reference.studies.hard import blocks, choosing, jitters, records, running, steps

CASES = {hard.name: hard for hard in records.read_all()}
FAST = [name for name in choosing.choices() if name not in ("fenicsx", "scikit_fem")]


def cell(name: str, solver: str, **settings: object) -> Cell:
    choice = choosing.choices()[solver]
    return running.cell(running.Posed(CASES[name]), SolverChoice(**{"solver": solver, **choice.settings, **settings}))


def test_every_folder_is_there_and_every_case_has_a_name_of_its_own() -> None:
    assert {name.partition(".")[0] for name in CASES} == set(records.folders())
    assert len(CASES) == len(records.read_all())


@pytest.mark.parametrize("hard", [hard for hard in CASES.values() if hard.block], ids=lambda hard: hard.name)
def test_blocks_are_whole(hard) -> None:
    problem = blocks.problem(hard)
    assert tet_volumes(problem.mesh.points, problem.mesh.tets).min() > 0
    assert all(len(problem.mesh.facets[entry.attachment]) for entry in problem.attached)
    assert np.isin(problem.surface.points, problem.mesh.points).all()
    assert hard.healthy
    assert set(hard.settings) <= set(choosing.choices())
    assert set(hard.only) <= set(choosing.choices())
    for choice in choosing.choices().values():
        running.solvers.settings(
            hard.choice(choice), hard.place, "solve_body" if choice.solver == "scikit_fem" else "solve"
        )


@pytest.mark.parametrize("solver", FAST)
def test_at_rest_stays_at_rest(solver) -> None:
    found = cell("at_rest.millimetres", solver)
    assert found.verdict == ("refused" if solver == "line_of_action" else "ok")


def test_holds_that_would_tear_an_edge_are_refused() -> None:
    """Whichever came last would win at the vertices that faces share."""
    hard = CASES["twist.whole_turn"]
    bottom, top = hard.hold
    for other in ("x0", "y1"):
        torn = hard.model_copy(update={"hold": (top, bottom.model_copy(update={"face": other}))})
        with pytest.raises(
            InputError, match=rf"hold\[1\]\.face: got {other}, which shares 4 vertices with z1 and moves other"
        ):
            blocks.problem(torn)
        found = running.cell(running.Posed(torn), choosing.choices()["pbd"])
        assert (found.verdict, "moves otherwise" in found.sentence) == ("refused", True)
    # Faces that move alike may meet, as may the middle of one.
    alike = (top, top.model_copy(update={"face": "x0"}))
    assert len(blocks.problem(hard.model_copy(update={"hold": alike})).attached) == 2
    middle = (top, bottom.model_copy(update={"face": "x0", "middle": True}))
    assert len(blocks.problem(hard.model_copy(update={"hold": middle})).attached) == 2


@pytest.mark.slow
def test_the_reference_stays_at_rest_in_every_unit_and_place() -> None:
    for name in ("at_rest.millimetres", "at_rest.metres", "at_rest.kilometre_away"):
        assert cell(name, "fenicsx").verdict == "ok"


@pytest.mark.slow
def test_fibres_that_pull_with_many_shear_moduli_end_alike_whatever_the_steps() -> None:
    found = cell("activation.both_ends_held", "fenicsx")
    assert found.verdict == "ok"
    assert float(found.sentence.split("steps: 1: ")[1].split(" %")[0]) < steps.SAME


@pytest.mark.slow
def test_a_bone_that_contact_does_not_hold_is_no_success() -> None:
    found = cell("bones.erleben_wedge", "fenicsx")
    assert found.verdict == "refused"
    assert "converged, but contact gives way: the surface is " in found.sentence
    assert 'mm deep in "wedge", whose middle is at 0.5 mm' in found.sentence


@pytest.mark.parametrize(
    ("name", "got", "want"),
    [
        ("bones.deep_overlap", "5.9 mm of overlap with the muscle at rest", "its middle is 6 mm deep"),
        ("degenerate.coincident", r"2.8e\+07 times as long as thick", "double precision"),
    ],
)
def test_what_no_mesh_and_no_direction_resolves_is_refused(name, got, want) -> None:
    with pytest.raises(InputError, match=f"got {got}, want less.*{want}"):
        _ = blocks.problem(CASES[name]).body


def test_the_farthest_frame_is_where_load_steps_are_compared() -> None:
    surface = blocks.problem(CASES["at_rest.millimetres"]).surface
    moved = [surface.points + shift for shift in (0.0, 3.0, 1.0)]
    assert steps.farthest(health.Followed((0, 5, 10), surface, np.array(moved))).until == 5
    assert steps.farthest(health.Followed((0, 5), surface, np.array(moved[:1] * 2))) is None
    assert steps.farthest(health.Followed((0,), surface, np.array(moved[:1]))) is None


def test_jitters_are_other_meshes_of_the_same_body_compared_at_the_same_material() -> None:
    hard = CASES["twist.whole_turn"]
    mesh = blocks.problem(hard).mesh
    others = [blocks.problem(jitters.jittered(hard, number)).mesh for number in (1, 2, 1)]
    assert np.array_equal(others[0].points, others[2].points)
    for other in others[:2]:
        moved = np.linalg.norm(other.points - mesh.points, axis=1)
        assert 0 < moved.max() < 2 * jitters.MOVED * 20 / 3  # of cells of 20 / 3 mm
        assert tet_volumes(other.points, other.tets).sum() == pytest.approx(20 * 20 * 60)
    assert not np.array_equal(others[0].points, others[1].points)

    def bent(one: records.Hard) -> tuple[Outcome, health.Followed]:
        """By a linear motion, which every mesh has exactly, and half a per cent of the size more by a mesh of the number 2."""
        built = blocks.problem(one)
        more = 0.005 * np.linalg.norm([20, 20, 60]) * (one.block.seed == 2)
        points, nodes = (
            where @ np.diag([1.0, 1.1, 0.9]) + [more, 0, 0] for where in (built.surface.points, built.mesh.points)
        )
        followed = health.Followed((0,), built.surface, points[None], built.mesh, nodes[None])
        return Outcome("diverged" if one.block.seed == 3 else "converged", "so"), followed

    same = jitters.compare(hard, bent(hard), 2, bent)
    assert same == steps.SameEnd(
        True, "jitters: 2 converged, up to frame 0, apart by 0.5 % at most, 0.25 % in the median"
    )
    assert not jitters.compare(hard, bent(hard), 3, bent).same


def test_jitters_of_a_shipped_case_have_tetrahedra_of_another_size() -> None:
    hard = CASES["hip.one_radian_at_once"]
    sizes = [jitters.jittered(hard, number).shipped.read().muscle.tet_size for number in (1, 2)]
    given = hard.shipped.read().muscle.tet_size
    assert sizes[0] != sizes[1]
    assert all(0 < abs(size / given - 1) < jitters.SIZES for size in sizes)


def test_what_explodes_with_finite_numbers_is_found_out() -> None:
    """Negative controls: a time step far beyond the stable one, and one time step for each frame."""
    exploded = cell("twist.one_radian_at_once", "mass_spring", time_step="20 ms")
    assert exploded.verdict == "failed"
    assert "stable one" in exploded.sentence
    folded = cell("twist.whole_turn", "xpbd", sub_steps=1)
    assert (folded.verdict, folded.quantity, folded.status) == ("degraded", "inside_out", "converged")


def test_a_bone_that_passes_between_frames_is_found_out() -> None:
    found = cell("bones.crosses_in_a_frame", "pbd")
    assert (found.verdict, found.quantity) == ("degraded", "passed")


@pytest.mark.slow
def test_where_inexact_linear_solutions_lead_nowhere_exact_ones_are_tried(monkeypatch) -> None:
    # Springs of 1e-3 Pa/mm hold the block along the plates: a force of 1 mN that is left over moves it by a metre.
    monkeypatch.setattr(skins, "_ACROSS", 10)  # few points of contact, in seconds
    hard = CASES["squeeze_sliding.4_cells"]
    block = hard.block.model_copy(update={"cells": (3, 3, 3)})
    built = running.Posed(hard.model_copy(update={"block": block})).problem
    given = hard.choice(choosing.choices()["fenicsx"]).settings
    given |= {"first_step": 2.0, "smallest_step": 2.0, "newton_iterations": 10}
    ends = []
    with fenicsx.shared():
        for kind in ("direct", "lagged"):
            frames = []
            settings = fenicsx.Settings(**given | {"linear_solver": kind})
            outcome = fenicsx.solve(replace(built, frames=(0, 2)), settings, frames.append)
            assert outcome.status == "converged", f"{kind}: {outcome.message}"
            ends.append(frames[-1].tets)
    # It is free to slide: by 1.3e-2 mm with what Newton's method leaves over, 1e-8 N.
    assert np.abs(ends[1] - ends[0]).max() < 1e-3


def test_a_solver_that_raises_has_failed(monkeypatch) -> None:
    monkeypatch.setattr(running, "_solved", lambda *_: 1 / 0)
    found = cell("at_rest.millimetres", "pbd")
    assert (found.verdict, found.status) == ("failed", "crashed")
    assert "ZeroDivisionError" in found.sentence


def test_a_busy_machine_turns_no_verdict(monkeypatch) -> None:
    """A solver that waits longer than it may work, and then solves, is judged as if it had not; one that works longer failed."""
    solve, waits, works = running._solved, [3.0], [0.0]

    def slow(*given):
        time.sleep(waits[0])
        until = time.process_time() + works[0]
        while time.process_time() < until:
            pass
        return solve(*given)

    monkeypatch.setattr(running, "_solved", slow)
    monkeypatch.setattr(running, "LIMIT", 1.0)  # twice that, of processor time
    assert cell("at_rest.millimetres", "pbd").verdict == "ok"
    waits[0], works[0] = 0.0, 10.0
    found = cell("at_rest.millimetres", "pbd")
    assert (found.verdict, found.status) == ("failed", "timed out")
    monkeypatch.setattr(running, "CLOCK", 0.5)
    waits[0], works[0] = 10.0, 0.0
    found = cell("at_rest.millimetres", "pbd")
    assert (found.verdict, found.status) == ("inconclusive", "stalled")
    assert "by the clock, and not 2 s of processor time" in found.sentence
    assert (
        running.signal.getitimer(running.signal.ITIMER_PROF)
        == running.signal.getitimer(running.signal.ITIMER_REAL)
        == (0, 0)
    )


def test_a_reference_that_stalls_is_inconclusive_in_every_part(monkeypatch) -> None:
    stalled = Outcome("stalled", "the machine was busy")
    hard = CASES["at_rest.millimetres"]
    stand_ins.solve_by(monkeypatch, fenicsx, lambda *_: stalled)
    monkeypatch.setattr(fenicsx, "solve", lambda *_: stalled)
    found = running.cell(running.Posed(hard), choosing.choices()["fenicsx"])
    assert (found.verdict, found.status, found.sentence) == ("inconclusive", "stalled", "stalled: the machine was busy")
    with pytest.raises(steps.StalledError, match="the machine was busy"):
        steps.compare(blocks.problem(hard), choosing.choices()["fenicsx"], records.Steps(until=2))


def test_what_a_case_is_not_about_is_refused_with_the_reason() -> None:
    hard = CASES["at_rest.millimetres"].model_copy(update={"only": ("pbd",), "because": "it is about PBD"})
    found = running.cell(running.Posed(hard), choosing.choices()["arap"])
    assert (found.verdict, found.sentence) == ("refused", "the case is about pbd only: it is about PBD")


def test_judging() -> None:
    history = History("volume", "%", (0, 1, 2), np.array([0.0, 3.0, 1.0]))
    blank = Cell("case", "pbd", "ok", "", "converged")
    assert stress.judge(blank, [(Bound(quantity="volume", at_most=2.0), history)]).verdict == "degraded"
    assert stress.judge(blank, [(Bound(quantity="volume", at_most=2.0, frame="last"), history)]).verdict == "ok"
    lost = replace(history, values=np.array([0.0, np.nan, 0.0]))
    found = stress.judge(blank, [(Bound(quantity="volume", at_most=2.0), lost)])
    assert (found.verdict, found.at) == ("failed", 1)
    shown, kept = (
        stress.judge(blank, [(Bound(quantity="volume", at_most=most), history)], "there is no pressure")
        for most in (2.0, 4.0)
    )
    assert (shown.verdict, kept.verdict) == ("degraded", "failed")
    assert shown.sentence.startswith("as it should be, for there is no pressure: volume 3 %")
    assert kept.sentence.startswith("though it should not be, for there is no pressure: volume 3 %")
    assert stress.doubted(blank, "", "it is flat") is blank
    assert [stress.doubted(blank, "unstable", why).verdict for why in ("", "it is flat")] == ["degraded", "refused"]
    assert stress.doubted(shown, "unstable", "it is flat") is shown
    ended = replace(blank, status="inverted")
    bounds = [(Bound(quantity="volume", at_most=2.0), history)]
    assert stress.unfinished(ended, "a cell", bounds, "").verdict == "failed"
    assert stress.unfinished(ended, "a cell", bounds, "it is flat").verdict == "refused"
    assert stress.unfinished(replace(blank, status="limit point"), "", bounds, "").verdict == "refused"
    assert stress.unfinished(replace(ended, status="timed out"), "", bounds, "it is flat").verdict == "failed"
    first = [(bounds[0][0], replace(history, numbers=(0,), values=history.values[:1]))]
    assert stress.unfinished(ended, "a cell", first, "it is flat").verdict == "failed"


def test_quantities_are_zero_at_rest_and_see_what_they_are_for() -> None:
    problem = blocks.problem(CASES["at_rest.millimetres"])
    rest = problem.surface.points
    mirrored = rest * [1, 1, -1]
    run = health.Followed((0, 1), problem.surface, np.array([rest, mirrored]), bones=problem.bones)
    assert health.history(run, "inside_out").values.tolist() == [0.0, 100.0]
    np.testing.assert_allclose(health.history(run, "volume").values, [0, 200])
    np.testing.assert_allclose(health.history(run, "stretch").values, [1, 1])
    assert health.history(run, "from_rest").values[1] > 100
    assert health.history(run, "penetration").values.tolist() == [0.0, 0.0]


def test_a_name_that_is_not_there() -> None:
    with pytest.raises(InputError, match=r"NAME: got \"nothing\", want one of activation, at_rest"):
        records.read_all(("nothing",))


BLOCK = """
title = "a"
healthy = "b"
bound = [{ quantity = "from_rest", at_most = 1 }]
block = { size = "20, 20, 60 mm", cells = [2, 2, 3] }
hold = [{ face = "z0" }]
frames = { first = 0, last = 2, every = 1 }
"""
CONTACT = 'effect = [{ name = "contact", stiffness = "500 kPa/mm", bones = ["d"] }]\n'
SPHERE = 'bone = [{ name = "c", sphere = { centre = "0, 0, 200 mm", radius = "5 mm" } }'
ROD = 'title = "a"\nhealthy = "b"\nbound = [{ quantity = "overshoot", at_most = 1 }]\n'


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[2, 2, 3]", "[2000, 2000, 2000]", "block: got .*want at most 50000 cells"),
        ("[2, 2, 3]", "[2, 2, 3], fibre = [0, 0, 0]", "block: got .*want a fibre that has a direction"),
        ("[2, 2, 3]", '[2, 2, 3], points_apart = "-1 mm"', "block.points_apart: got .*want more than zero"),
        ("at_most = 1", "at_most = -1", r"bound\[0\].at_most: got -1"),
        ("from_rest", "overshoot", r"bound\[0\].quantity: got .*want overshoot for a scalar field, and only there"),
        ('{ face = "z0" }', '{ face = "z0" }, { face = "z0" }', "hold: got .*want every face once"),
        ("frames", 'contrast = "c"\nno_solution = "d"\nframes', 'contrast: got "c", want nothing beside "no_solution"'),
        ("frames", 'settings = { pdb = { damping = 1 } }\nframes', 'settings.pdb: got "pdb", want one of fenicsx'),
        ("frames", "settings = { pbd = { dampong = 1 } }\nframes", "settings.pbd.dampong: got an unknown key, want damping"),
        ("frames", 'settings = { pbd = { solver = "xpbd" } }\nframes', "settings.pbd.solver: got an unknown key"),
        ("frames", 'only = ["pdb"]\nbecause = "c"\nframes', r'only\[0\]: got "pdb", want one of fenicsx'),
        ("frames", "steps = { until = 3 }\nframes", "steps.until: got 3, want a frame after 0, up to 2"),
        ("frames", "steps = { until = 0 }\nframes", "steps.until: got 0, want a frame after 0, up to 2"),
        ("frames", "steps = { until = 2, counts = [0] }\nframes", r"steps.counts\[0\]: got 0, want greater than 0"),
        ("frames", "steps = { until = 2, counts = [] }\nframes", r"steps.counts: got \[\]"),
        ("frames", 'effect = [{ mu = "1 kPa" }]\nframes', r"effect\[0\].name: got .*want one of active_tension"),
        ("frames", 'effect = [{ name = "neo_hooke", nu = 1 }]\nframes', r"effect\[0\].nu: got an unknown key, want one of mu"),
        ("frames", 'bone = [{ name = "c", surface = "c.ply", unit = "mm" }]\nframes', "bone: got .*want bones of closed forms"),
        ("frames", CONTACT + SPHERE + "]\nframes", r'effect\[0\].bones: got "d", want one of c'),
        ("frames", SPHERE + SPHERE.replace("bone = [", ", ") + "]\nframes", 'bone: got the name "c" twice'),
        ("frames", 'effect = [{ name = "inertia", density = "1 g/ml" }]\nframes', "frames.interval: got nothing, want the time"),
        ("frames", "variant = 3\nframes", "variant: got 3, want tables"),
        ("frames", "variant = [3]\nframes", r"variant: got \[3\], want tables"),
        ("frames", "variant = []\nframes", r"variant: got \[\], want tables"),
        ("frames", 'variant = [{ title = "c" }]\nframes', r"variant\[0\].name: got '', want a name of its own"),
        ("frames", 'variant = [{ name = "c" }, { name = "c" }]\nframes', r"variant\[1\].name: got 'c', want a name of its"),
        ("frames", 'variant = [{ name = "<b>" }]\nframes', r'variant\[0\].name: got "hard.<b>"'),
        ("frames", 'name = "c"\nframes', "name: got an unknown key"),
        ("frames", f"x = {'[' * 5000}{']' * 5000}\nframes", "case.toml: got tables or lists more than 32 deep"),
        (BLOCK, ROD + 'shipped = { case = "nothing" }', 'CASE: got "nothing"'),
        (BLOCK, ROD + 'shipped = { case = "rod", changes = { "a.b" = 1 } }', "a.b: got nothing, want a key"),
        (BLOCK, ROD.replace("overshoot", "volume") + 'shipped = { case = "rod" }', r'bound\[0\].quantity: got "volume"'),
        (BLOCK, ROD + 'shipped = { case = "rod" }\nsteps = { until = 1 }', "steps.until: got 1"),
    ],
)  # fmt: skip
def test_a_mistake_in_a_file_is_no_refusal_by_a_solver(old, new, message, tmp_path) -> None:
    path = tmp_path / "hard" / "case.toml"
    path.parent.mkdir()
    path.write_text(BLOCK)
    assert [hard.name for hard in records.read(path)] == ["hard"]
    path.write_text(BLOCK.replace(old, new, 1))
    with pytest.raises(InputError, match=message):
        list(records.read(path))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('title = "a"\nhealthy = "b"\n[[bound]]\nquantity = "colour"\nat_most = 1', "as colour is not"),
        ('title = "a"\nhealthy = "b"', "bound: got nothing"),
        ("title = ", "a TOML file"),
    ],
)
def test_a_wrong_file_is_refused(text, message, tmp_path) -> None:
    (tmp_path / "case.toml").write_text(text)
    with pytest.raises(InputError, match=message):
        list(records.read(tmp_path / "case.toml"))


@pytest.mark.parametrize(
    ("words", "got"),
    [
        (["--jitters", "-1"], "--jitters: got -1, want 0 or more"),
        (["--steps", "--solver", "pbd"], "--steps: got it with pbd alone, want --solver fenicsx too"),
        (["--jitters", "2", "--solver", "pbd", "--solver", "arap"], "--jitters: got it with pbd, arap alone, want"),
    ],
)
def test_runs_of_the_reference_that_nobody_would_make_are_refused(words, got, tmp_path, capsys) -> None:
    assert cli.main(["stress", "at_rest.millimetres", "--out", str(tmp_path), *words]) == cli.BAD_INPUT
    assert got in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_the_verb_and_its_page(tmp_path, capsys) -> None:
    words = ["stress", "at_rest.millimetres", "--solver", "pbd", "--solver", "xpbd", "--out", str(tmp_path)]
    assert cli.main([*words, "--json", str(tmp_path / "facts.json"), "--quiet"]) == cli.DONE
    assert "1 hard cases by 2 solvers: 2 ok, 0 degraded, 0 failed, 0 refused, 0 inconclusive" in capsys.readouterr().out
    page = (tmp_path / "stress-at_rest.millimetres-pbd-xpbd.html").read_text(encoding="utf-8")
    assert page.count('class="cell"') == 2
    assert page.count('src="data:image/webp') == 2
    facts = json.loads((tmp_path / "facts.json").read_text())
    assert [entry["verdict"] for entry in facts["cells"]] == ["ok", "ok"]
