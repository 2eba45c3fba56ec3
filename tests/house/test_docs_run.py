"""Every command and every piece of Python in the README and the pages is run, on a small case in the place of ``hip_flexion``.

What takes minutes, or is run by other tests, has a comment above it that says so: ``<!-- not run: why -->`` for the whole piece,
``<!-- not run: "BEGINNING OF A LINE": why -->`` for lines of it. ``SMALL`` is all that is written in another way.
"""

import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pages
import pytest
import small

import fem_reference as fr
from fem_reference import cli
from fem_reference.io import files
from fem_reference.solvers.fenicsx import processes

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not processes.installed(), reason="FEniCSx is not installed"),
]

# What the pages say, and what is said here: a case of seconds, its bones, and a frame that it has.
SMALL = {"hip_flexion": "bar", '"pelvis"': '"floor"', '"femur"': '"lid"', "frame=100": "frame=10"}
# The effect of fibres that hip_flexion has and the small case has not.
FIBRES = small.FIBRES.format(slack=1.0)
# Commands whose verdict is fail, as their page says.
FAILS = ("./fem run rod --solver listing --set",)
PIECE = re.compile(r"((?:^<!--.*?-->\n+)*)^```(sh|python)\n(.*?)^```", re.DOTALL | re.MULTILINE)
NOT_RUN = re.compile(r'<!-- not run: (?:"(.*?)": )?(.*?) -->', re.DOTALL)


def pieces() -> list[tuple[str, str, str, list[tuple[str, str]]]]:
    """Page, language, text, and what is not run of it, of every piece."""
    return [
        (name, language, text, NOT_RUN.findall(comments))
        for name in pages.PAGES
        for comments, language, text in PIECE.findall(pages.page(name))
    ]


def lines_to_run(text: str, left_out: list[tuple[str, str]]) -> list[str]:
    """The commands of a piece that are run here; those of examples are run by test_examples.py."""
    lines = [
        line
        for line in text.splitlines()
        if line and not line.startswith(("#", "python examples/", "pytest examples/"))
    ]
    return [line for line in lines if not any(line.startswith(beginning) for beginning, _ in left_out)]


def made_small(text: str) -> str:
    """A piece about the small case."""
    for what, other in SMALL.items():
        text = text.replace(what, other)
    return text


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where all of them run one after the other: the small case, and frames of it that another program might have written."""
    home = tmp_path_factory.mktemp("pages")
    text = (small.write(home / "bar") / "case.toml").read_text()
    (home / "bar" / "case.toml").write_text(text.replace("[fibres]", f"{FIBRES}\n[fibres]"))
    case = fr.load_case(home / "bar")
    run = fr.solve(case, "pbd", store=home / "reports" / "runs")
    for name in ("mine", "my_solver"):
        (home / name).mkdir()
        for number, points in zip(run.numbers, run.positions, strict=True):
            files.write_surface(home / name / f"frame_{number:04d}.ply", run.surface, np.array(points))
    return home


@pytest.mark.usefixtures("without_pictures")
def test_commands_and_python_do_what_they_say(folder: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(folder)
    for name, language, text, left_out in pieces():
        if any(not beginning for beginning, _ in left_out):
            continue
        if language == "python":
            exec(compile(made_small(text), name, "exec"), {"__name__": "snippet"})
            continue
        for line in lines_to_run(text, left_out):
            command, *words = shlex.split(made_small(line).split(" > ")[0], comments=True)
            assert command in ("./fem", "fem-reference"), f"{name}: {line}"
            if "--to" in words:
                shutil.rmtree(words[words.index("--to") + 1], ignore_errors=True)  # pages begin anew
            if "--update" in words:
                Path(words[words.index("--baseline") + 1]).unlink(missing_ok=True)
            status = cli.main([*words, "--quiet"])
            printed = capsys.readouterr()
            expected = cli.VERDICT_FAIL if line.startswith(FAILS) else cli.DONE
            assert status == expected, f"{name}: {line}\n{printed.out}{printed.err}"
    assert list(Path("reports").glob("*/report.html"))
    left = ("my_report/report.html", "scene/scene.json", "blender/lid.pc2")
    assert all(Path(name).exists() for name in left)


def test_what_is_not_run_is_there_and_has_a_reason() -> None:
    for name, language, text, left_out in pieces():
        for beginning, why in left_out:
            assert len(why) > 10, name
            assert any(line.startswith(beginning) for line in text.splitlines()), f"{name}: {beginning}"
            assert not beginning or language == "sh"
        for line in text.splitlines() if language == "sh" else []:
            if match := re.match(r"(?:python|pytest) (examples/\S+)", line):
                assert (pages.ROOT / match[1]).exists(), line
    said = "".join(map(pages.page, pages.PAGES)).count("<!-- not run")
    assert said == sum(len(left_out) for *_, left_out in pieces())  # each is above a piece
