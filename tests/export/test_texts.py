"""Texts beside an export: their examples run, and every file is explained."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from fem_reference.foundations.motion import apply
from fem_reference.foundations.records import parse
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.solvers import recorded

pytestmark = pytest.mark.slow


def code(text: str) -> str:
    """The only example in Python."""
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    return block


def test_the_reading_example_runs(exported: Path, built: MuscleProblem) -> None:
    """With numpy and meshio, from a process that cannot see this project; numpy prints 8 digits."""
    text = (exported / "README.md").read_text()
    words = [sys.executable, "-I", "-W", "error", "-c", code(text)]
    said = subprocess.run(words, cwd=exported, capture_output=True, text=True, check=True).stdout
    head, numbers = said.split(" at [")
    insertion = built.attached[1]
    assert head == f"At frame 10, lid has vertices {' '.join(map(str, insertion.vertices))}"
    moved = apply(insertion.bone.pose(10), built.surface.points[insertion.vertices])
    found = np.array(re.findall(r"-?\d+\.?\d*(?:e[+-]\d+)?", numbers), float).reshape(-1, 3)
    assert np.allclose(found, moved, rtol=0, atol=1e-6)


def test_every_file_is_explained(exported: Path) -> None:
    text = (exported / "README.md").read_text()
    names = {path.name for path in exported.iterdir()} - {"README.md", "bones"}
    assert {name for name in names if f"`{name}`" not in text} == set()


def test_the_example_of_a_candidate_is_one(exported: Path) -> None:
    """As it stands, and with what is a comment in it: every key there is."""
    text = (exported / "candidate.toml").read_text()
    assert recorded.about(exported).unit == "mm"
    every = tomllib.loads(re.sub(r"^# (?=\w+ = )", "", text, flags=re.MULTILINE))
    assert parse(recorded.About, every, "test").seconds_per_frame == 0.01
    assert every.keys() == recorded.About.model_fields.keys()
