"""The verb ``stress``: its page, and runs that nobody would make."""

import json
import sys
from pathlib import Path

import pytest

from fem_reference import cli

PROGRAM = """
import pathlib, shutil, sys
scene, out = map(pathlib.Path, sys.argv[-2:])
for frame in (0, 5, 10, 15, 20):
    shutil.copy(scene / "muscle.ply", out / f"frame_{frame:04d}.ply")
"""


@pytest.mark.parametrize(
    ("words", "got"),
    [
        (["--jitters", "-1"], "--jitters: got -1, want 0 or more"),
        (["--steps", "--solver", "pbd"], "--steps: got this option with pbd alone, want --solver fenicsx too"),
        (
            ["--jitters", "2", "--solver", "pbd", "--solver", "arap"],
            "--jitters: got this option with pbd, arap alone, want",
        ),
    ],
)
def test_runs_of_the_reference_that_nobody_would_make_are_refused(words, got, tmp_path, capsys) -> None:
    assert cli.main(["stress", "at_rest.millimetres", "--out", str(tmp_path), *words]) == cli.BAD_INPUT
    assert got in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_the_verb_and_its_page(tmp_path, capsys) -> None:
    words = ["stress", "at_rest.millimetres", "--solver", "pbd", "--solver", "xpbd", "--out", str(tmp_path)]
    assert cli.main([*words, "--json", str(tmp_path / "facts.json"), "--quiet"]) == cli.DONE
    counts = "2 ok, 0 degraded, 0 failed, 0 not applicable, 0 no solution, 0 inconclusive"
    assert f"1 hard cases by 2 solvers: {counts}" in capsys.readouterr().out
    page = (tmp_path / "stress-at_rest.millimetres-pbd-xpbd.html").read_text(encoding="utf-8")
    assert page.count('class="cell"') == 2
    assert page.count('src="data:image/webp') == 2
    facts = json.loads((tmp_path / "facts.json").read_text())
    assert [entry["verdict"] for entry in facts["cells"]] == ["ok", "ok"]


@pytest.mark.slow
def test_a_program_of_somebody_else_is_judged_where_it_takes_what_acts(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=":")
    (tmp_path / "still").mkdir()
    (tmp_path / "still" / "still.py").write_text(PROGRAM)
    (tmp_path / "still" / "candidate.toml").write_text(
        'name = "still"\nlaw = "stable_neo_hooke"\n[settings]\npoisson = 0.45\n'
    )
    names = ["at_rest.millimetres", "bones.crosses_in_a_frame"]
    words = ["stress", *names, "--program", str(tmp_path / "still"), "--out", str(tmp_path)]
    assert cli.main([*words, "--json", str(tmp_path / "found.json")]) == cli.DONE
    found = json.loads((tmp_path / "found.json").read_text())
    assert [(one["solver"], one["verdict"]) for one in found["cells"]] == [
        ("still", "ok"),
        ("still", "not applicable"),
    ]
    assert "it leaves out effects of this case: contact" in found["cells"][1]["sentence"]
