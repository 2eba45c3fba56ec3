"""Learned and shipped solvers on the test frames of a data set: ``python baselines.py FOLDER JSON``."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from learn import errors

import fem_reference as fr


def shipped(folder: Path, solver: str) -> Iterator[dict]:
    """Mean distance [mm] of a shipped solver from the truth, over the muscles that it solved, and processor time [s], by split."""
    splits = json.loads((folder / "dataset.json").read_text(encoding="utf-8"))["splits"]
    away, seconds = {}, {}
    for name in (name for name in splits["pose"]["train"] if name.startswith("muscle")):
        truth = np.load(folder / "scenes" / name / "frames.npz")["positions"]
        run = fr.solve(fr.load_case(folder / "scenes" / name), solver)
        if run.outcome.status == "converged":
            away[name] = np.linalg.norm(run.positions - truth, axis=2).mean(axis=1)
            seconds[name] = run.outcome.cost["seconds_processor"]
    for split, parts in splits.items():
        test = {name: rows for name, rows in parts["test"].items() if name.startswith("muscle")}
        known = {name: away[name][rows].mean() for name, rows in test.items() if name in away}
        row = {
            "split": split,
            "solver": solver,
            "learned": False,
            "error": np.mean([*known.values()]),
            "muscles": len(known),
        }
        yield row | {"seconds": sum(seconds[name] for name in known), "lost": sorted(set(test) - set(known))}


if __name__ == "__main__":
    rows = [*errors(sys.argv[1])]
    for name in ("arap", "xpbd"):
        rows += shipped(Path(sys.argv[1]), name)
    Path(sys.argv[2]).write_text(json.dumps(rows, indent=1), encoding="utf-8")
