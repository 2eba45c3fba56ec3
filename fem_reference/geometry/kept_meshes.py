"""Disk cache for tetrahedra and other arrays that are slow to compute. Files are written atomically and replaced if damaged."""

import logging
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference import foundations
from fem_reference.foundations.mesh import Floats, Surface, TetMesh, fingerprint
from fem_reference.foundations.version import versions
from fem_reference.io import files

log = logging.getLogger(__name__)

Arrays = dict[str, Any]
Mesher = Callable[[Surface, float, Mapping[str, Floats]], TetMesh]
_MADE_WITH = ("gmsh", "pytetwild", "libigl", "numpy", "scipy")
_FACETS = "facets "


def cached(mesher: Mesher, surface: Surface, size: float, shares: Mapping[str, Floats], folder: Path | None) -> TetMesh:
    """Return the tetrahedra that ``mesher`` makes from a surface, ``size`` [mm] and ``shares``, as in
    :func:`fem_reference.geometry.tetrahedra.tetrahedralise`.

    If there is a ``folder``, the tetrahedra are stored there under a hash of everything on which they depend, including the code of
    :mod:`fem_reference.foundations` and :mod:`fem_reference.geometry` and the versions of packages that make meshes.
    """
    if folder is None:
        return mesher(surface, size, shares)
    names = np.frombuffer("\0".join([*shares, code()]).encode(), np.uint8)
    key = fingerprint(surface.points, surface.triangles, *shares.values(), np.array([size]), names)
    return kept(folder / f"tetrahedra_{key[:32]}.npz", lambda: mesher(surface, size, shares), _arrays, _mesh)


@cache
def code() -> str:
    """Hash of the ``sources`` and of the versions of the packages that make meshes."""
    contents = [np.frombuffer(path.read_bytes(), np.uint8) for path in sources()]
    return f"{fingerprint(*contents)} {versions(_MADE_WITH)}"


def sources() -> list[Path]:
    """The source files with all code on which stored arrays depend: those of this folder and those of the foundations."""
    folders = Path(foundations.__file__).parent, Path(__file__).parent
    return [path for folder in folders for path in sorted(folder.glob("*.py"))]


def _mesh(arrays: Arrays) -> TetMesh:
    facets = {name.removeprefix(_FACETS): array for name, array in arrays.items() if name.startswith(_FACETS)}
    return TetMesh(arrays["points"], arrays["tets"], facets, str(arrays["maker"]))


def _arrays(mesh: TetMesh) -> Arrays:
    facets = {f"{_FACETS}{name}": facets for name, facets in mesh.facets.items()}
    return {"points": mesh.points, "tets": mesh.tets, "maker": np.array(mesh.maker)} | facets


def kept[T](path: Path, make: Callable[[], T], to_arrays: Callable[[T], Arrays], of_arrays: Callable[[Arrays], T]) -> T:
    """Return what ``of_arrays`` reads from the file at ``path``; without a valid file, store and return the result of ``make``."""
    found = _read(path, of_arrays)
    if found is None:
        found = make()
        _write(path, to_arrays(found))
    return found


def _read[T](path: Path, of_arrays: Callable[[Arrays], T]) -> T | None:
    """Read the value in a file; None if the file is missing or cannot be read completely."""
    if not path.is_file():
        return None
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            return of_arrays(dict(arrays))
    except Exception as error:  # zipfile and numpy raise many types of errors on a damaged file
        log.warning("%s: the stored arrays are damaged and are computed again: %s", path, error)
        return None


def _write(path: Path, arrays: Arrays) -> None:
    """Store arrays, safely even if several processes do so at the same time; log a warning if the file cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with files.whole(path) as part:
            np.savez(part, allow_pickle=False, **arrays)
    except OSError as why:
        log.warning("%s: the arrays were not stored: %s", path, why)
