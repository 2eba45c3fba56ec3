"""Tetrahedra that were made before, on disk: gmsh takes seconds to a minute for what takes a hundredth of that to read."""

import importlib.metadata
import logging
import tempfile
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.foundations.mesh import Floats, Surface, TetMesh, fingerprint

log = logging.getLogger(__name__)

Mesher = Callable[[Surface, float, Mapping[str, Floats]], TetMesh]
_MADE_WITH = ("gmsh", "pytetwild", "libigl", "numpy", "scipy")
_FACETS = "facets "


def cached(mesher: Mesher, surface: Surface, size: float, shares: Mapping[str, Floats], folder: Path | None) -> TetMesh:
    """What ``mesher`` makes of a surface, stored under a hash of all that it depends on, this folder and its packages among it.

    Parameters
    ----------
    mesher, surface, size, shares
        As of :func:`fem_reference.geometry.tetrahedra.tetrahedralise`.
    folder
        Where meshes are stored; a damaged file is made anew. None: nowhere.

    """
    if folder is None:
        return mesher(surface, size, shares)
    names = np.frombuffer("\0".join([*shares, _code()]).encode(), np.uint8)
    key = fingerprint(surface.points, surface.triangles, *shares.values(), np.array([size]), names)
    path = folder / f"tetrahedra_{key[:32]}.npz"
    mesh = _read(path)
    if mesh is None:
        mesh = mesher(surface, size, shares)
        try:
            _write(path, mesh)
        except OSError as why:
            log.warning("%s: not kept: %s", path, why)
    return mesh


@cache
def _code() -> str:
    """All of the source here, and the versions of the packages that meshes are made with."""
    folder = Path(__file__).parent
    sources = [np.frombuffer(path.read_bytes(), np.uint8) for path in sorted(folder.glob("*.py"))]
    versions = dict[str, str]()
    for package in _MADE_WITH:
        try:
            versions[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            versions[package] = "none"
    return f"{fingerprint(*sources)} {versions}"


def _read(path: Path) -> TetMesh | None:
    """The mesh of a file, None where there is none that can be read whole."""
    if not path.is_file():
        return None
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as kept:
            facets = {name.removeprefix(_FACETS): kept[name] for name in kept.files if name.startswith(_FACETS)}
            return TetMesh(kept["points"], kept["tets"], facets, str(kept["maker"]))
    except Exception as error:  # zipfile and numpy raise whatever occurs to them over a damaged file
        log.warning("%s: damaged, made anew: %s", path, error)
        return None


def _write(path: Path, mesh: TetMesh) -> None:
    """The file whole or not at all, also where several processes write it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    arrays: dict[str, Any] = {"points": mesh.points, "tets": mesh.tets, "maker": np.array(mesh.maker)}
    arrays |= {f"{_FACETS}{name}": facets for name, facets in mesh.facets.items()}
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".") as folder:
        part = Path(folder) / path.name
        np.savez_compressed(part, allow_pickle=False, **arrays)
        part.replace(path)
