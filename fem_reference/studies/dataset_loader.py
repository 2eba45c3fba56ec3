"""Loader of a data set of muscles, which needs only numpy; it checks every file of the data set against its hash."""

import hashlib
import json
import sys
from pathlib import Path

import numpy as np


def load(folder: str | Path, split: str = "pose", part: str = "train") -> list[tuple[dict[str, np.ndarray], list[int]]]:
    """Load the scenes in a ``part`` ("train" or "test") of a ``split`` ("pose" or "shape"), each as its arrays by name and the
    indices of the frames that belong to the part. Raises ValueError if a file of the data set was changed.
    """
    index = json.loads((Path(folder) / "dataset.json").read_text(encoding="utf-8"))
    for name, known in index["sha256"].items():
        if hashlib.sha256((Path(folder) / name).read_bytes()).hexdigest() != known:
            raise ValueError(f"{name} is not the file of this data set: its hash differs")
    chosen = index["splits"][split][part].items()
    return [(dict(np.load(Path(folder) / "scenes" / name / "frames.npz")), rows) for name, rows in chosen]


if __name__ == "__main__":
    for own in ("train", "test"):
        scenes = load(Path(__file__).parent, part=own)
        sys.stdout.write(f"{own}: {sum(len(rows) for _, rows in scenes)} frames in {len(scenes)} scenes\n")
