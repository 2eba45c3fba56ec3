"""Learned solvers on unseen poses and shapes: ``python learn.py FOLDER`` prints mean distances of vertices from the truth."""

import runpy
import sys
import time
from collections.abc import Iterator

import numpy as np
from fits import kernel, network


def blended(one: dict) -> np.ndarray:
    """Linear blend skinning: each vertex moves with both bones, weighted by its height. The fits learn the remainder."""
    at = np.c_[one["points"], np.ones(len(one["points"]))]
    upper, lower = (at @ one["poses"][:, i, :3].transpose(0, 2, 1) for i in (0, 1))
    return lower + at[:, 2:3] / at[:, 2].max() * (upper - lower)


def features(one: dict) -> np.ndarray:
    """Poses of up to three bones and activation in each frame; widths of the shape at seven heights, its length and bow."""
    poses = np.pad(one["poses"][:, :, :3] - np.eye(4)[:3], [(0, 0), (0, 3 - one["poses"].shape[1]), (0, 0), (0, 0)])
    fixed = [*np.ptp(one["points"][:420].reshape(21, 20, 3)[::3], axis=1)[:, :2].ravel()]
    fixed += [one["points"][:, 2].max(), one["points"][200:220, 0].mean()]
    return np.c_[poses.reshape(len(poses), -1), one["activation"], np.tile(fixed, (len(poses), 1))]


def learned(fit, seen: list, one: dict, rows: list) -> np.ndarray:
    """Positions in the frames ``rows`` of a scene: ``fit`` predicts coefficients of the modes of the ``seen`` displacements."""
    x = np.concatenate([features(other)[r] for other, r in seen])
    y = np.concatenate([(other["positions"] - blended(other))[r].reshape(len(r), -1) for other, r in seen])
    modes = np.linalg.svd(y, full_matrices=False)[2][:20]
    scale = np.where((spread := x.std(axis=0)) > 1e-9, spread * (spread > 1e-9).sum() ** 0.5, np.inf)
    x, at = (x - x.mean(axis=0)) / scale, (features(one)[rows] - x.mean(axis=0)) / scale
    return blended(one)[rows] + (fit(x, y @ modes.T, at) @ modes).reshape(len(rows), -1, 3)


def of(folder: str, split: str, part: str) -> list:
    """The muscles generated at random, read by the loader of the data set."""
    load = runpy.run_path(f"{folder}/load.py")["load"]
    return [pair for pair in load(folder, split, part) if len(pair[0]["points"]) == 422]


def errors(folder: str) -> Iterator[dict]:
    """Mean distance [mm] over the test muscles, and their total processor time [s], for each split and fit."""
    for split in ("pose", "shape"):
        train, test = of(folder, split, "train"), of(folder, split, "test")
        for fit in (kernel, network, None):
            away, begin = [], time.process_time()
            for i, (one, rows) in enumerate(test):
                found = learned(fit, [train[i]] if split == "pose" else train, one, rows) if fit else blended(one)[rows]
                away.append(np.linalg.norm(found - one["positions"][rows], axis=2).mean())
            name, seconds = fit.__name__ if fit else "linear blend skinning", time.process_time() - begin
            row = {"split": split, "solver": name, "learned": fit is not None}
            yield row | {"error": np.mean(away), "muscles": len(test), "seconds": seconds}


if __name__ == "__main__":
    for row in errors(sys.argv[1]):
        print("{split}, {solver}: {error:.3f} mm, {muscles} muscles, {seconds:.2f} s".format(**row))
