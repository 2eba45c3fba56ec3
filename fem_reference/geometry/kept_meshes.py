"""Tetrahedra stored on disk: gmsh takes seconds to a minute, reading a hundredth of that."""

import importlib.metadata
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.foundations.mesh import Floats, Surface, TetMesh, fingerprint
from fem_reference.geometry.kept_arrays import kept

Mesher = Callable[[Surface, float, Mapping[str, Floats]], TetMesh]
_MADE_WITH = ("gmsh", "pytetwild", "libigl", "numpy", "scipy")
_FACETS = "facets "


def cached(mesher: Mesher, surface: Surface, size: float, shares: Mapping[str, Floats], folder: Path | None) -> TetMesh:
    """The tetrahedra that ``mesher`` makes from a surface, ``size`` [mm] and ``shares``, as in
    :func:`fem_reference.geometry.tetrahedra.tetrahedralise`.

    They are stored in ``folder``, unless it is None, under a hash of all that they depend on, including this package and those
    that it imports.
    """
    if folder is None:
        return mesher(surface, size, shares)
    names = np.frombuffer("\0".join([*shares, code()]).encode(), np.uint8)
    key = fingerprint(surface.points, surface.triangles, *shares.values(), np.array([size]), names)
    return kept(folder / f"tetrahedra_{key[:32]}.npz", lambda: mesher(surface, size, shares), _arrays, _mesh)


@cache
def code() -> str:
    """A hash of all source files here, and of the versions of the packages that make meshes."""
    folder = Path(__file__).parent
    sources = [np.frombuffer(path.read_bytes(), np.uint8) for path in sorted(folder.glob("*.py"))]
    versions = dict[str, str]()
    for package in _MADE_WITH:
        try:
            versions[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            versions[package] = "none"
    return f"{fingerprint(*sources)} {versions}"


def _mesh(arrays: dict[str, Any]) -> TetMesh:
    facets = {name.removeprefix(_FACETS): array for name, array in arrays.items() if name.startswith(_FACETS)}
    return TetMesh(arrays["points"], arrays["tets"], facets, str(arrays["maker"]))


def _arrays(mesh: TetMesh) -> dict[str, Any]:
    facets = {f"{_FACETS}{name}": facets for name, facets in mesh.facets.items()}
    return {"points": mesh.points, "tets": mesh.tets, "maker": np.array(mesh.maker)} | facets
