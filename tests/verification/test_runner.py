"""The catalogue is found, chosen from and measured: in its order, two at a time, and whatever an entry does."""

import json
import logging
import math
import os
import re
import sys
import threading
import time
from contextlib import contextmanager
from types import ModuleType
from typing import get_args

import pytest

from fem_reference import cli
from fem_reference.assessment.catalogue import Entry, Finding, Kind, order
from fem_reference.foundations.errors import InputError, MissingSoftware
from fem_reference.report import pages
from fem_reference.runs.solved import Solved
from fem_reference.runs.store import Outcome
from fem_reference.verification import runner, truths


def entry(name, measure=1.0, group="blocks", **changes) -> Entry:
    """An entry whose truth is 1, within 0.1; ``measure`` is its value, or what is done with the lab."""
    printed = {
        "title": f"The {name}",
        "unit": "mm",
        "because": "rounding",
        "source": "by hand",
        "negative_control": "twice as much",
    }
    numbers = {"truth": lambda: 1.0, "within": 0.1, "relative": False, "kind": "closed form"}
    measure = measure if callable(measure) else lambda _, value=measure: Finding(value)
    table = printed | numbers | {"measure": measure, "with_negative_control": lambda _: Finding(2.0)} | changes
    return Entry(name=name, group=group, **table)


def raising(error) -> Entry:
    def measure(_):
        raise error

    return entry("raising", measure)


class Labs:
    """Makes labs, and knows how many were made and how many are open."""

    def __init__(self) -> None:
        self.made, self.open = 0, 0

    @contextmanager
    def __call__(self):
        self.made, self.open = self.made + 1, self.open + 1
        try:
            yield self.made
        finally:
            self.open -= 1


def catalogue(*entries) -> dict[str, Entry]:
    return {one.name: one for one in entries}


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


def test_every_entry_there_is_says_what_a_reader_needs() -> None:
    for name, one in runner.entries().items():
        assert one.name == name
        assert one.kind in get_args(Kind)
        assert one.within > 0, name
        assert all(getattr(one, key).strip() for key in ("group", "title", "because", "source", "negative_control")), (
            name
        )


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
def test_an_entry_that_raises_fails_alone(error) -> None:
    failed, other = runner.run([raising(error), entry("other")], Labs())
    assert (failed.word, other.word) == ("fail", "pass")
    assert math.isnan(failed.finding.value)
    assert failed.finding.note == f"{type(error).__name__}: {error}"


def test_a_truth_that_raises_fails_its_entry_alone() -> None:
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


# The verb


@pytest.fixture
def verify(monkeypatch, tmp_path, capsys):
    """Calls the verb on a small catalogue: the exit status, what is printed and the JSON."""
    known = catalogue(entry("bar", group="bars"), entry("rod", group="bars", unit="N"), entry("tip", 3.0, "beams"))
    made = ModuleType("fem_reference.verification.lab")
    made.lab = Labs()
    monkeypatch.setattr(runner, "entries", lambda: known)
    monkeypatch.setitem(sys.modules, made.__name__, made)

    def call(*words):
        status = cli.main(["verify", *words, "--out", str(tmp_path / "out"), "--quiet"])
        stored = next((tmp_path / "out").glob("verify*.json"), None)
        return status, capsys.readouterr(), None if stored is None else json.loads(stored.read_text())

    call.made, call.folder = made, tmp_path
    return call


def test_all_pass(verify) -> None:
    target = verify.folder / "below" / "facts.json"
    status, printed, facts = verify("bars", "--json", str(target))
    assert status == cli.DONE
    head, *lines, summary, page = printed.out.splitlines()
    assert head.split() == ["entry", "value", "truth", "unit", "error", "within", "order", "seconds", "verdict"]
    assert [line.split() for line in lines] == [
        [name, "1", "1", unit, "0", "0.1", "0.0", "pass"] for name, unit in (("bar", "mm"), ("rod", "N"))
    ]
    assert {line.index("pass") for line in lines} == {head.index("verdict")}
    assert summary == "verdict: pass, 2 of 2 pass, 0 s"
    # A part does not stand in the place of the whole.
    assert page == f"page: {verify.folder / 'out' / 'verify-bars.html'}"
    assert not (verify.folder / "out" / "verify.html").exists()
    assert (verify.folder / "out" / "verify-bars.html").read_text().startswith("<!DOCTYPE html>")
    assert json.loads(target.read_text()) == facts
    assert (facts["verdict"], facts["passed"], facts["of"]) == ("pass", 2, 2)
    assert {"fem_reference", "python", "numpy"} <= set(facts["versions"])


def test_without_names_all_are_measured_and_one_that_fails_is_reported(verify) -> None:
    status, printed, facts = verify()
    assert status == cli.VERDICT_FAIL
    assert [row["name"] for row in facts["entries"]] == ["bar", "rod", "tip"]
    assert "verdict: fail, 2 of 3 pass" in printed.out


@pytest.mark.parametrize(
    ("words", "names"),
    [(["--negative-control", "bar"], ["bar"]), (["rod", "--negative-control", "b*r"], ["bar", "rod"])],
)
def test_a_negative_control_is_measured_and_fails(verify, words, names) -> None:
    status, printed, facts = verify(*words)
    assert status == cli.VERDICT_FAIL
    assert [row["name"] for row in facts["entries"]] == names
    assert [row["with_negative_control"] for row in facts["entries"]] == [name == "bar" for name in names]
    assert "fail (negative control)" in printed.out
    assert (
        f"verdict: fail, {len(names) - 1} of {len(names)} pass, 1 measured with their negative control" in printed.out
    )


@pytest.mark.parametrize(
    ("words", "place"), [(["nobody"], "NAME"), (["--negative-control", "nobody"], "--negative-control")]
)
def test_an_unknown_name_is_bad_input(verify, words, place) -> None:
    status, printed, facts = verify(*words)
    assert status == cli.BAD_INPUT
    assert f'{place}: got "nobody", want an entry, a group (bars, beams)' in printed.err
    assert facts is None
    assert verify.made.lab.made == 0


def test_a_page_that_cannot_be_written_leaves_what_was_measured_reported(verify, monkeypatch) -> None:
    def full(*_):
        raise OSError("no space left")

    target = verify.folder / "facts.json"
    monkeypatch.setattr(pages, "write", full)
    status, printed, _ = verify("bars", "--json", str(target))
    assert status == cli.BAD_INPUT
    assert "no space left" in printed.err
    assert "verdict: pass, 2 of 2 pass" in printed.out
    assert json.loads(target.read_text())["verdict"] == "pass"


@pytest.mark.parametrize("option", ["--out", "--json"])
def test_an_output_below_a_file_is_refused_before_anything_is_measured(option, verify, capsys) -> None:
    file = verify.folder / "file"
    file.write_text("mine")
    assert cli.main(["verify", "bars", option, str(file / "below" / "it")]) == cli.BAD_INPUT
    assert f'where "{file}" is a file, want a folder' in capsys.readouterr().err
    assert verify.made.lab.made == 0
    assert [path.name for path in verify.folder.iterdir()] == ["file"]


def test_a_folder_that_cannot_be_written_into_is_refused_before_anything_is_measured(
    verify, capsys, monkeypatch
) -> None:
    monkeypatch.setattr(os, "access", lambda *_: False)  # the tests may run as root, who can write anywhere
    assert cli.main(["verify", "bars", "--out", str(verify.folder / "new")]) == cli.BAD_INPUT
    assert "cannot be written into" in capsys.readouterr().err
    assert verify.made.lab.made == 0
    assert cli.main(["list", "--out", str(verify.folder / "new")]) == cli.DONE


@pytest.mark.parametrize("words", [["verify"], ["list"], ["page", "octave-examples"], ["show", "hip_flexion"]])
def test_ranks_are_for_verbs_that_solve_a_muscle(words, capsys) -> None:
    with pytest.raises(SystemExit, match="2"):
        cli.main([*words, "--ranks", "2"])
    assert "unrecognized arguments: --ranks" in capsys.readouterr().err


def test_a_body_of_the_catalogue_has_a_time_limit() -> None:
    from fem_reference.verification.lab import FemLab

    class Noted:
        def solve(self, _, settings):
            return Solved((), Outcome("timed out", f"{settings.time_limit:g}"))

    lab = FemLab(Noted())
    assert lab.solve(None, "P2/P1").outcome.message == "1800"
    assert lab.solve(None, "P2/P1", time_limit="5 s").outcome.message == "5"


def test_the_order_is_the_slope_of_the_last_two_errors() -> None:
    # An error of 3 h^2.5 about a truth of 2; rounding of numbers near 2 over the smaller error, 3e-16 / 3e-3.
    ladder = tuple((h, 2 + 3 * h**2.5) for h in (0.25, 0.125, 0.0625))
    assert order(ladder, 2.0) == pytest.approx(2.5, abs=1e-12)
    assert order(((1.0, 2.5), (0.5, 2.0)), 2.0) is None


def test_without_fenicsx_it_says_so(verify) -> None:
    def lab():
        raise MissingSoftware("FEniCSx is not installed")

    verify.made.lab = lab
    status, printed, _ = verify("bar")
    assert status == cli.SOLVER_FAILED
    assert "FEniCSx is not installed" in printed.err


# Truths


def test_the_list_of_truths_names_every_module_and_no_other() -> None:
    listed = re.findall(r"^\| `(\w+)\.py`", (truths.FOLDER / "README.md").read_text(), re.MULTILINE)
    assert sorted(listed) == sorted(path.stem for path in truths.FOLDER.glob("*.py") if path.stem != "__init__")


@pytest.fixture
def unloaded(monkeypatch):
    """As if no truth had been loaded yet."""
    for name in [name for name in sys.modules if name.split(".")[0] == "validation"]:
        monkeypatch.delitem(sys.modules, name)
    yield
    for name in [name for name in sys.modules if name.split(".")[0] == "validation"]:
        del sys.modules[name]


@pytest.mark.usefixtures("unloaded")
def test_truths_are_found_wherever_python_looks(monkeypatch) -> None:
    monkeypatch.setattr(
        sys, "path", [path for path in sys.path if path.endswith(("site-packages", "python3.12", "zip"))]
    )
    # Timoshenko and Goodier give 0.1406 with four digits.
    assert truths.find("torsion").square_bar_stiffness(2.0, 1.0) == pytest.approx(2 * 0.1406, abs=1e-4)
    with pytest.raises(ModuleNotFoundError, match="nothing_of_the_kind"):
        truths.find("nothing_of_the_kind")


@pytest.mark.usefixtures("unloaded")
def test_truths_may_import_each_other(monkeypatch, tmp_path) -> None:
    folder = tmp_path / "validation"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "base.py").write_text("three = 3\n")
    (folder / "top.py").write_text("from validation.base import three\n\nsix = 2 * three\n")
    monkeypatch.setattr(truths, "FOLDER", folder.resolve())
    assert truths.find("top").six == 6
    assert truths.find("base") is truths.find("base")


@pytest.mark.usefixtures("unloaded")
def test_another_package_of_that_name_is_refused(monkeypatch, tmp_path) -> None:
    other = ModuleType("validation")
    other.__path__ = [str(tmp_path)]
    monkeypatch.setitem(sys.modules, "validation", other)
    with pytest.raises(ImportError, match='another package "validation" is loaded'):
        truths.find("torsion")
