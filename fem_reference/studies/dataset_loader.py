"""Loader of a data set of muscles, with numpy alone; ``python load.py`` in its folder checks every file against its hash."""

import hashlib
import json
from pathlib import Path

import numpy as np


def load(folder: str | Path, split: str = "pose", part: str = "train") -> list[tuple[dict[str, np.ndarray], list[int]]]:
    """The scenes in a ``part`` ("train" or "test") of a ``split`` ("pose" or "shape"): arrays by name, and the rows in the part."""
    index = json.loads((Path(folder) / "dataset.json").read_text(encoding="utf-8"))
    for name, known in index["sha256"].items():
        if hashlib.sha256((Path(folder) / name).read_bytes()).hexdigest() != known:
            raise ValueError(f"{name} is not the file of this data set: its hash differs")
    chosen = index["splits"][split][part].items()
    return [(dict(np.load(Path(folder) / "scenes" / name / "frames.npz")), rows) for name, rows in chosen]
