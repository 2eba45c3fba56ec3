"""The catalogue is found, chosen from and measured: in its order, two at a time, and whatever an entry does."""

import logging
import math
import os
import signal
import threading
import time
from contextlib import contextmanager
from types import ModuleType

import pytest

from fem_reference.assessment.catalogue import Finding
from fem_reference.foundations.errors import InputError, MissingSoftware
from fem_reference.verification import runner
from tests.signals import Losing, listening
from tests.verification.stand_ins import Labs, catalogue, entry, raising


def module(name, *entries) -> ModuleType:
    made = ModuleType(name)
    if entries:
        made.ENTRIES = entries
    return made


def test_modules_give_their_entries_in_order() -> None:
    found = runner.collect([module("one", entry("b"), entry("a")), module("shapes"), module("two", entry("c"))])
    assert list(found) == ["b", "a", "c"]


def test_a_name_is_given_once() -> None:
    with pytest.raises(ValueError, match='two: a second entry "a"'):
        runner.collect([module("one", entry("a")), module("two", entry("a"))])


@pytest.mark.parametrize(
    ("wanted", "names"),
    [
        (["bar_end"], "bar_end"),
        (["tip", "bar_end"], "bar_end tip"),
        (["bars"], "bar_end bar_middle"),
        (["*_end", "beams"], "bar_end tip beam_end"),
        (["bar_[!e]*"], "bar_middle"),
        ([], ""),
    ],
)
def test_names_groups_and_patterns_choose_in_the_order_of_the_catalogue(wanted, names) -> None:
    bars = [entry("bar_end", group="bars"), entry("bar_middle", group="bars")]
    known = catalogue(*bars, entry("tip", group="beams"), entry("beam_end", group="beams"))
    assert runner.choose(known, wanted, "NAME") == tuple(names.split())


def test_a_name_that_is_not_there_is_reported_with_those_that_are() -> None:
    known = catalogue(entry("bar"), entry("tip", group="beams"))
    want = r'NAME: got "Bar", want an entry \(such as bar\), a group \(blocks, beams\) or a pattern of them'
    with pytest.raises(InputError, match=want):
        runner.choose(known, ["tip", "Bar"], "NAME")


def test_an_unknown_name_is_answered_shortly_however_many_there_are() -> None:
    known = catalogue(*(entry(f"bar_{i}") for i in range(100)), entry("tip", group="beams"))
    with pytest.raises(InputError) as refused:
        runner.choose(known, ["tipp"], "NAME")
    assert refused.value.want == "an entry (such as tip), a group (blocks, beams) or a pattern of them"
    with pytest.raises(InputError) as refused:
        runner.choose(known, ["bar_100"], "NAME")
    assert refused.value.want.count("bar_") == 5


def test_results_keep_their_order_and_every_thread_its_lab(monkeypatch) -> None:
    monkeypatch.setattr(runner.os, "sched_getaffinity", lambda _: set(range(8)))
    both, used = threading.Barrier(2, timeout=5), []

    def meet(lab):
        both.wait()  # passes only when two entries are measured at once
        used.append((lab, threading.get_ident()))
        return Finding(1.0)

    def last(_):
        time.sleep(0.05)
        return Finding(1.05)

    labs = Labs()
    results = runner.run([entry("slow", meet), entry("first", meet), entry("late", last), entry("done")], labs)
    assert [one.entry.name for one in results] == ["slow", "first", "late", "done"]
    assert [one.word for one in results] == ["pass"] * 4
    assert results[2].error == pytest.approx(0.05, abs=1e-12)
    assert 0.05 <= results[2].seconds < 5
    assert len(set(used)) == len({lab for lab, _ in used}) == labs.made == 2
    assert labs.open == 0


def test_no_more_labs_than_work_or_cores(monkeypatch) -> None:
    labs = Labs()
    assert runner.run([], labs) == ()
    assert labs.made == 0
    runner.run([entry("one")], labs)
    assert labs.made == 1
    monkeypatch.setattr(runner.os, "sched_getaffinity", lambda _: set(range(1)))
    runner.run([entry("one"), entry("two")], labs)
    assert labs.made == 2


@pytest.mark.parametrize(
    "error",
    [
        InputError("mesh", "none", "one"),
        ValueError("no root"),
        FloatingPointError("overflow"),
        KeyError("end"),
        RuntimeError("it ended"),
        OSError("pipe"),
    ],
)
def test_an_entry_that_raises_fails_alone(error, monkeypatch) -> None:
    monkeypatch.setattr(runner, "HEARD", 0.0)
    failed, other = runner.run([raising(error), entry("other")], Labs())
    assert (failed.word, other.word) == ("fail", "pass")
    assert math.isnan(failed.finding.value)
    assert failed.finding.note == f"{type(error).__name__}: {error}"


def test_a_truth_that_raises_fails_its_entry_alone(monkeypatch) -> None:
    monkeypatch.setattr(runner, "HEARD", 0.0)

    def no_truth():
        raise ValueError("no root")

    both = entry("both", raising(OSError("pipe")).measure, truth=no_truth)
    lost, nothing, other = runner.run([entry("lost", truth=no_truth), both, entry("other")], Labs())
    assert (lost.word, nothing.word, other.word) == ("inconclusive", "inconclusive", "pass")
    assert lost.finding.value == 1.0  # what was measured is kept
    assert all(math.isnan(number) for number in (lost.truth, lost.within, lost.error, nothing.finding.value))
    assert lost.finding.note == "no truth, ValueError: no root"
    assert nothing.finding.note == "OSError: pipe; no truth, ValueError: no root"


@pytest.mark.parametrize("error", [TypeError("ours"), KeyboardInterrupt("stop"), MissingSoftware("FEniCSx")])
def test_what_is_no_failure_of_an_entry_ends_everything(error, monkeypatch) -> None:
    monkeypatch.setattr(runner.os, "sched_getaffinity", lambda _: set(range(1)))
    labs, measured = Labs(), []
    with pytest.raises(type(error), match=str(error)):
        runner.run([raising(error), entry("next", lambda _: measured.append(1))], labs)
    assert labs.open == 0
    assert measured == []


def test_a_thread_stops_after_its_entry_when_the_other_met_a_mistake(monkeypatch) -> None:
    monkeypatch.setattr(runner.os, "sched_getaffinity", lambda _: set(range(2)))
    closed, measured = threading.Event(), []

    @contextmanager
    def make_lab():
        try:
            yield
        finally:
            closed.set()

    def slow(_):
        assert closed.wait(5)  # the labs close while this is still measured
        measured.append("slow")
        return Finding(1.0)

    later = [entry(f"later_{i}", lambda _: measured.append("later")) for i in range(3)]
    with pytest.raises(TypeError, match="ours"):
        runner.run([entry("slow", slow), raising(TypeError("ours")), *later], make_lab)
    assert measured == ["slow"]


@pytest.mark.parametrize("lost", [False, True])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_to_the_command_judges_no_entry(number, lost, caplog, monkeypatch) -> None:
    """Also if Python first loses the exception of the signal, as in a callback or in a deletion."""
    monkeypatch.setattr(runner.os, "sched_getaffinity", lambda _: set(range(2)))
    before = signal.signal(signal.SIGUSR1, lambda *_: [Losing(number)].clear())
    struck, measured = threading.Event(), []

    def dies(_):  # the processes of labs end by the signal that ends the command, one of them before it is heard here
        struck.set()
        raise RuntimeError("the process of FEniCSx ended with exit status -2")

    def dies_first(lab):
        threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGUSR1 if lost else number)).start()
        return dies(lab)

    def dies_later(lab):
        assert struck.wait(5)
        time.sleep(0.2)
        return dies(lab)

    later = [entry(f"later_{i}", lambda _: measured.append("later")) for i in range(3)]
    ended = pytest.raises((SystemExit, KeyboardInterrupt))
    try:
        with caplog.at_level(logging.INFO, "fem_reference"), ended, listening():
            runner.run([entry("first", dies_first), entry("second", dies_later), *later], Labs())
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert (measured, caplog.messages) == ([], [])


def test_an_entry_without_a_value_fails(monkeypatch) -> None:
    monkeypatch.setattr(runner, "HEARD", 0.0)
    none, other = runner.run([entry("none", lambda _: None), entry("other")], Labs())
    assert (none.word, none.finding.note, other.word) == ("fail", "no value was measured", "pass")


def test_entries_that_fail_with_a_number_wait_for_no_signal(monkeypatch) -> None:
    """Only one without a number may be an end by a signal that has yet to reach this process: 0.5 s each, far above a second."""
    monkeypatch.setattr(runner.os, "sched_getaffinity", lambda _: set(range(1)))
    begin = time.perf_counter()
    found = runner.run([entry(f"off_{i}", 3.0) for i in range(6)], Labs())
    assert [one.word for one in found] == ["fail"] * 6
    assert time.perf_counter() - begin < 1.5


def test_a_lab_that_cannot_be_made_closes_the_others(monkeypatch) -> None:
    monkeypatch.setattr(runner.os, "sched_getaffinity", lambda _: set(range(2)))
    labs = Labs()

    def second_fails():
        if labs.made:
            raise MissingSoftware("no second FEniCSx")
        return labs()

    with pytest.raises(MissingSoftware, match="no second"):
        runner.run([entry("one"), entry("two")], second_fails)
    assert (labs.made, labs.open) == (1, 0)


def test_an_entry_with_negative_control_is_measured_with_its_negative_control() -> None:
    good, bad = runner.run([entry("good"), entry("bad")], Labs(), frozenset({"bad"}))
    assert (good.word, good.with_negative_control, good.finding.value) == ("pass", False, 1.0)
    assert (bad.word, bad.with_negative_control, bad.finding.value) == ("fail", True, 2.0)


def test_progress_says_how_far_it_is(caplog, monkeypatch) -> None:
    monkeypatch.setattr(runner.os, "sched_getaffinity", lambda _: set(range(1)))
    with caplog.at_level(logging.INFO, "fem_reference"):
        runner.run([entry("bar"), entry("tip", 3.0)], Labs())
    assert caplog.messages == ["verify: 1 of 2, bar pass, 0 s, about 0 s left", "verify: 2 of 2, tip fail, 0 s"]
