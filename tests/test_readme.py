"""What the README lists is what there is, in both directions."""

import argparse
import re
import tomllib
from pathlib import Path

import fem_reference as fr
from fem_reference import metrics, solvers
from fem_reference.cli._parser import parser

README = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")


def listed(heading: str) -> list[str]:
    """The names at the beginning of rows of the first table whose head begins with ``heading``."""
    table = README[README.index(f"| {heading} |") :].split("\n\n")[0]
    return re.findall(r"^\| `(\w+)", table, re.MULTILINE)


def test_the_solvers() -> None:
    assert sorted(listed("solver")) == solvers.names("solve")


def test_the_metrics() -> None:
    assert sorted(listed("metric")) == metrics.names()


def test_the_verbs() -> None:
    (verbs,) = (action for action in parser()._actions if isinstance(action, argparse._SubParsersAction))
    assert sorted(set(listed("verb"))) == sorted(verbs.choices)


def test_the_scene_is_complete() -> None:
    scene = README[README.index("## Write a scene") :]
    table = tomllib.loads(scene.split("```toml\n")[1].split("```")[0])
    case = fr.make_case(table, name="my_muscle")
    assert [bone.name for bone in case.bone] == ["femur", "pelvis"]
    assert case.frames.numbers[-1] == 100


def test_nothing_is_left_to_fill_in() -> None:
    assert "@@" not in README


def test_every_file_that_is_linked_is_there() -> None:
    home = Path(__file__).parent.parent
    for page in (home / "README.md", *(home / "docs").glob("*.md")):
        links = re.findall(r"\]\((?!https?:|#)([^)#]+)", page.read_text(encoding="utf-8"))
        assert not [link for link in links if not (page.parent / link).exists()], page
