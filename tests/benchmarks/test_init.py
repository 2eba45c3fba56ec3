"""The suite as asv sees it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks import over

ROOT = Path(__file__).parents[2]


def test_parameters_are_where_asv_looks_for_them() -> None:
    @over("mm", size=(1, 2), name="ab")
    def track() -> float:
        return 1.0

    assert (track.unit, track.params, track.param_names) == ("mm", ([1, 2], ["a", "b"]), ("size", "name"))
    assert track() == 1.0


@pytest.mark.slow
def test_asv_finds_the_suite_whole() -> None:
    pytest.importorskip("asv", reason="asv is not installed")
    words = [sys.executable, "-m", "asv", "check", "--config", str(ROOT / "benchmarks" / "asv.conf.json")]
    environment = os.environ | {"ASV_PYTHONPATH": str(ROOT)}
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "No problems found" in done.stdout
