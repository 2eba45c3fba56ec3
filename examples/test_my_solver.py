"""A regression test in pytest: my solver has not changed, and is no further from the reference than its baseline allows.

Run "pytest test_my_solver.py" in a separate folder. In your own project the baseline is a committed file.
"""

import subprocess
import sys

import pytest
from own_scene import make
from own_solver import write_frames


def check(*words: str) -> int:
    """The exit status of "fem-reference check": 0 pass, 1 fail."""
    command = [sys.executable, "-P", "-m", "fem_reference", "check", "my_muscle", "--baseline", "baseline.json"]
    return subprocess.run([*command, "--candidate", "my_solver", "--quiet", *words], check=False).returncode


@pytest.fixture(scope="module")
def case():
    """The scene, with a baseline of the unchanged solver."""
    made = make()
    write_frames(made, "my_solver")
    assert check("--update") == 0
    return made


def test_my_solver_is_as_good_as_it_was(case):
    """The solver is unchanged, so the check passes."""
    write_frames(case, "my_solver")
    assert check("--markdown", "check.md", "--junit", "check.xml") == 0


def test_a_mistake_in_my_solver_is_found(case):
    """The mistake displaces the lower end of the muscle, so the check fails."""
    write_frames(case, "my_solver", share_at_end=0.9)
    assert check() == 1
