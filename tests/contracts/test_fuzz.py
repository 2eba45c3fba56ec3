"""Damaged input and calls, drawn at random but the same every time: accepted, or refused by a sentence. ``tests/fuzz.py`` tries
more.
"""

import os
import subprocess
from pathlib import Path

import pytest

from fem_reference.foundations.subprocesses import command, environment

PROGRAM = Path(__file__).parents[1] / "fuzz.py"


@pytest.mark.slow
@pytest.mark.parametrize(("inputs", "seed"), [(25, 7), pytest.param(160, 8, marks=pytest.mark.nightly)])
def test_damaged_input_is_accepted_or_refused(inputs: int, seed: int, tmp_path: Path) -> None:
    """No other exception, no end by a signal, no more than 10 s and 2 GB, and no pass of what is not what it was."""
    words = command(str(PROGRAM), "--inputs", str(inputs), "--seed", str(seed), "--kept", str(tmp_path))
    settings = environment(OMP_NUM_THREADS="1")
    settings["PYTHONPATH"] += os.pathsep + str(PROGRAM.parent)
    done = subprocess.run(words, env=settings, cwd=tmp_path, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1].endswith(" inputs, 0 failed")
