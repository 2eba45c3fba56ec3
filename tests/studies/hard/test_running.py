"""Every solver on hard cases: runs become verdicts and never tracebacks, and what explodes is found out."""

import sys
import time
from dataclasses import replace

import numpy as np
import pytest
import stand_ins
from hard_cases import CASES

from fem_reference.assessment.stress import Cell
from fem_reference.geometry import skins
from fem_reference.runs.store import Outcome
from fem_reference.scenes.case import SolverChoice
from fem_reference.solvers import fenicsx, pbd
from fem_reference.studies.hard import following, records, running

FAST = [name for name in records.choices() if name not in ("fenicsx", "scikit_fem")]


def cell(name: str, solver: str, **settings: object) -> Cell:
    choice = records.choices()[solver]
    return running.cell(running.Posed(CASES[name]), SolverChoice(**{"solver": solver, **choice.settings, **settings}))


@pytest.mark.slow
@pytest.mark.parametrize("solver", FAST)
def test_at_rest_stays_at_rest(solver) -> None:
    found = cell("at_rest.millimetres", solver)
    assert found.verdict == ("not applicable" if solver == "line_of_action" else "ok")


def test_a_solver_that_leaves_out_what_acts_is_no_success() -> None:
    """A bone that nobody feels leaves the block at rest, which would be healthy."""
    choice = records.choices()["pbd"]
    for name, takes, lacks in (
        ("bones.crosses_in_a_frame", (), "contact"),
        ("round_edge.tendon", ("contact",), "fibre_passive"),
    ):
        found = running.cell(running.Posed(CASES[name]), choice, takes)
        assert (found.verdict, found.sentence) == ("not applicable", f"it leaves out effects of this case: {lacks}")
    assert running.cell(running.Posed(CASES["at_rest.millimetres"]), choice, ()).verdict == "ok"


@pytest.mark.slow
def test_the_reference_stays_at_rest_in_every_unit_and_place() -> None:
    for name in ("at_rest.millimetres", "at_rest.metres", "at_rest.kilometre_away"):
        assert cell(name, "fenicsx").verdict == "ok"


@pytest.mark.slow
def test_fibres_that_pull_with_many_shear_moduli_end_alike_whatever_the_steps() -> None:
    found = cell("activation.both_ends_held", "fenicsx")
    assert found.verdict == "ok"
    assert float(found.sentence.split("steps: 1: ")[1].split(" %")[0]) < following.SAME


@pytest.mark.slow
def test_a_bone_that_contact_does_not_hold_is_no_success() -> None:
    found = cell("bones.erleben_wedge", "fenicsx")
    assert found.verdict == "no solution"
    assert "converged, but contact gives way: the surface is " in found.sentence
    assert 'mm deep in "wedge", whose middle is 0.5 mm deep' in found.sentence


@pytest.mark.slow
def test_bodies_in_each_other_are_no_success_and_contact_keeps_them_apart() -> None:
    """Negative control: without contact one body comes down by 0.8 mm, through a gap of 0.2 mm, into the other."""
    hard, choice = CASES["neighbours.narrow"], records.choices()["fenicsx"]
    hard = hard.model_copy(update={"frames": hard.frames.model_copy(update={"last": 4, "every": 4})})
    without = hard.model_copy(update={"effect": hard.effect[:2]})
    with fenicsx.shared():
        apart, within = (running.cell(running.Posed(one), one.choice(choice)) for one in (hard, without))
    assert (apart.verdict, apart.quantity) == ("ok", "crossed")
    assert (within.verdict, within.status) == ("failed", "denied")
    assert "penetration of block and narrow into each other: 0.6 mm in frame 4" in within.sentence


@pytest.mark.slow
def test_what_explodes_with_finite_numbers_is_found_out() -> None:
    """Negative controls: a time step far beyond the stable one, and one time step for each frame."""
    exploded = cell("twist.one_radian_at_once", "mass_spring", time_step="20 ms")
    assert exploded.verdict == "failed"
    assert "stable step" in exploded.sentence
    folded = cell("twist.whole_turn", "xpbd", sub_steps=1)
    assert (folded.verdict, folded.quantity, folded.status) == ("degraded", "inside_out", "converged")


@pytest.mark.slow
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
    given = hard.choice(records.choices()["fenicsx"]).settings
    given |= {"first_step": 2.0, "smallest_step": 2.0, "newton_iterations": 10}
    ends = []
    with fenicsx.shared():
        for kind in ("direct", "lagged"):
            frames = []
            settings = fenicsx.Settings(**given | {"linear_solver": kind})
            outcome = fenicsx.solve(replace(built, frames=(0, 2)), settings, frames.append)
            assert outcome.status == "converged", f"{kind}: {outcome.message}"
            ends.append(frames[-1].points)
    # It is free to slide: by 1.3e-2 mm with what Newton's method leaves over, 1e-8 N.
    assert np.abs(ends[1] - ends[0]).max() < 1e-3


def test_a_solver_that_raises_has_failed(monkeypatch) -> None:
    stand_ins.solve_by(monkeypatch, pbd, lambda *_: 1 / 0)
    found = cell("at_rest.millimetres", "pbd")
    assert (found.verdict, found.status) == ("failed", "crashed")
    assert "ZeroDivisionError" in found.sentence


@pytest.mark.slow
def test_a_busy_machine_turns_no_verdict(monkeypatch) -> None:
    """A solver that waits longer than it may work, and then solves, is judged as if it had not; one that works longer failed."""
    solve, waits, works = pbd.solve, [3.0], [0.0]

    def slow(*given):
        time.sleep(waits[0])
        until = time.process_time() + works[0]
        while time.process_time() < until:
            pass
        return solve(*given)

    stand_ins.solve_by(monkeypatch, pbd, slow)
    monkeypatch.setattr(running, "LIMIT", 1.0)  # twice that, of processor time
    assert cell("at_rest.millimetres", "pbd").verdict == "ok"
    waits[0], works[0] = 0.0, 10.0
    found = cell("at_rest.millimetres", "pbd")
    assert (found.verdict, found.status) == ("failed", "timed out")
    monkeypatch.setattr(running, "CLOCK", 0.5)
    waits[0], works[0] = 10.0, 0.0
    found = cell("at_rest.millimetres", "pbd")
    assert (found.verdict, found.status) == ("inconclusive", "stalled")
    assert "of clock time, but less than 2 s of processor time" in found.sentence
    assert (
        running.signal.getitimer(running.signal.ITIMER_PROF)
        == running.signal.getitimer(running.signal.ITIMER_REAL)
        == (0, 0)
    )


def test_a_limit_ends_a_solver_even_if_its_first_exception_is_lost(monkeypatch) -> None:
    """As Python loses what is raised in a callback or a deletion that happens to run."""
    lost = []

    def work(seconds) -> None:
        until = time.process_time() + seconds
        while time.process_time() < until:
            pass

    class Deleted:
        def __del__(self) -> None:
            work(2.0)

    def solve(*_):
        Deleted()
        work(10.0)
        raise AssertionError("without a limit")

    monkeypatch.setattr(sys, "unraisablehook", lambda found: lost.append(found.exc_type))
    stand_ins.solve_by(monkeypatch, pbd, solve)
    monkeypatch.setattr(running, "LIMIT", 0.1)  # twice that, of processor time
    found = cell("at_rest.millimetres", "pbd")
    assert (found.status, len(lost)) == ("timed out", 1)


def test_a_reference_that_stalls_is_inconclusive(monkeypatch) -> None:
    stalled = Outcome("stalled", "the machine was busy")
    hard = CASES["at_rest.millimetres"]
    stand_ins.solve_by(monkeypatch, fenicsx, lambda *_: stalled)
    found = running.cell(running.Posed(hard), records.choices()["fenicsx"])
    assert (found.verdict, found.status, found.sentence) == ("inconclusive", "stalled", "stalled: the machine was busy")


def test_what_a_case_is_not_about_is_refused_with_the_reason() -> None:
    hard = CASES["at_rest.millimetres"].model_copy(update={"only": ("pbd",), "because": "it is about PBD"})
    found = running.cell(running.Posed(hard), records.choices()["arap"])
    assert (found.verdict, found.sentence) == ("not applicable", "only for pbd: it is about PBD")
