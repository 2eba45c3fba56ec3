"""The loader as a command, on a data set of two scenes made by hand: it counts frames, and stops if a file was changed."""

import hashlib
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fem_reference.studies import dataset_loader


@pytest.mark.slow
def test_as_a_command_it_counts_frames_and_checks_every_file(tmp_path: Path) -> None:
    hashes = {}
    for name in ("a", "b"):
        path = tmp_path / "scenes" / name / "frames.npz"
        path.parent.mkdir(parents=True)
        np.savez(path, positions=np.zeros((4, 1, 3)))
        hashes[str(path.relative_to(tmp_path))] = hashlib.sha256(path.read_bytes()).hexdigest()
    split = {"train": {"a": [0, 1, 2], "b": [0, 3]}, "test": {"a": [3]}}
    (tmp_path / "dataset.json").write_text(json.dumps({"sha256": hashes, "splits": {"pose": split}}))
    shutil.copy(dataset_loader.__file__, tmp_path / "load.py")

    def loaded() -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-I", tmp_path / "load.py"]
        return subprocess.run(command, capture_output=True, text=True, check=False, cwd="/")

    assert loaded().stdout.splitlines() == ["train: 5 frames in 2 scenes", "test: 1 frames in 1 scenes"]
    (tmp_path / "scenes" / "b" / "frames.npz").write_bytes(b"changed")
    found = loaded()
    assert found.returncode == 1
    assert "scenes/b/frames.npz is not the file of this data set" in found.stderr
