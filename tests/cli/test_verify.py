"""The verb verify: what is measured, printed and stored, and what is refused before anything is measured."""

import json
import os
import sys
from types import ModuleType

import pytest

from fem_reference import cli
from fem_reference.foundations.errors import MissingSoftware
from fem_reference.report import pages
from fem_reference.verification import runner
from tests.verification.stand_ins import Labs, catalogue, entry


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
    assert "is not writable" in capsys.readouterr().err
    assert verify.made.lab.made == 0
    assert cli.main(["list", "--out", str(verify.folder / "new")]) == cli.DONE


@pytest.mark.parametrize("words", [["verify"], ["list"], ["page", "octave-examples"], ["show", "hip_flexion"]])
def test_ranks_are_for_verbs_that_solve_a_muscle(words, capsys) -> None:
    with pytest.raises(SystemExit, match="2"):
        cli.main([*words, "--ranks", "2"])
    assert "unrecognized arguments: --ranks" in capsys.readouterr().err


def test_without_fenicsx_it_says_so(verify) -> None:
    def lab():
        raise MissingSoftware("FEniCSx is not installed")

    verify.made.lab = lab
    status, printed, _ = verify("bar")
    assert status == cli.SOLVER_FAILED
    assert "FEniCSx is not installed" in printed.err
