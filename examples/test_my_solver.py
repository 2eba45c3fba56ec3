"""A regression check in pytest: that my solver is what it was, and no further from the reference than its baseline allows.

Run it as "pytest test_my_solver.py" in a folder of its own. In a project of yours the baseline is a file that is committed.
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
    """The scene, and a baseline of the solver as it is."""
    made = make()
    write_frames(made, "my_solver")
    assert check("--update") == 0
    return made


def test_my_solver_is_as_good_as_it_was(case):
    """Nothing was changed."""
    write_frames(case, "my_solver")
    assert check("--markdown", "check.md", "--junit", "check.xml") == 0


def test_a_mistake_in_my_solver_is_found(case):
    """Which the lower end of the muscle shows."""
    write_frames(case, "my_solver", share_at_end=0.9)
    assert check() == 1
