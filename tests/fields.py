"""Scalar scenes for tests from python tables, and the meshes that they stand on."""

from pathlib import Path
from typing import Any

import numpy as np
import shapes
from scipy.spatial import Delaunay

from fem_reference import effects
from fem_reference.foundations.records import parse
from fem_reference.scenes.scalar import ScalarCase

_HARMLESS = {
    "title": "a test",
    "proves": "nothing",
    "reference": {"solver": "fenicsx"},
    "candidate": (),
    "expect": [
        {
            "of": "reference",
            "metric": "minimum",
            "truth": 0.0,
            "within": 0.0,
            "kind": "property",
            "because": "some",
        }
    ],
    "negative_control": {"key": "title", "value": "another", "because": "it is harmless"},
}


def scene(folder: Path, **tables: Any) -> ScalarCase:
    """The scene of ``domain``, ``effect``, ``boundary``, ``element`` (else P1, galerkin) and ``exact``, as a file has them."""
    acting = tuple(
        parse(effects.find(table["name"]), {key: value for key, value in table.items() if key != "name"}, "effect")
        for table in tables["effect"]
    )
    filled = _HARMLESS | {"boundary": (), "element": element()} | tables | {"effect": acting}
    return parse(ScalarCase, filled | {"name": folder.name, "folder": folder}, "case.toml")


def element(order: int = 1, form: str = "galerkin") -> dict[str, Any]:
    """The table of an element."""
    return {"order": order, "form": form}


def mesh(folder: Path, points: np.ndarray, triangles: np.ndarray) -> dict[str, Any]:
    """The table of a domain of ``triangles``, whose two files this writes."""
    np.savetxt(folder / "points.csv", points, fmt="%.17g", delimiter=",")
    np.savetxt(folder / "triangles.csv", triangles + 1, fmt="%d", delimiter=",")
    return {"mesh": {"points": "points.csv", "triangles": "triangles.csv"}}


def square(folder: Path, count: int) -> dict[str, Any]:
    """The unit square, ``count`` vertices along each side, those inside moved at random by up to a fifth of their distance."""
    axis = np.linspace(0, 1, count)
    points = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    inside = ((points > 0) & (points < 1)).all(axis=1)
    points[inside] += np.random.default_rng(4).uniform(-0.2, 0.2, (inside.sum(), 2)) / (count - 1)
    return mesh(folder, points, Delaunay(points).simplices)


def sphere(folder: Path, subdivisions: int = 2) -> dict[str, Any]:
    """The unit sphere in space."""
    surface = shapes.sphere(subdivisions)
    return mesh(folder, surface.points, surface.triangles)
