"""The key of a run: a hash over the scene, the settings, and the source code on which the solver depends."""

import ast
import hashlib
import json
import os
import platform
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from fem_reference.foundations import version
from fem_reference.foundations.version import __version__

PACKAGE = Path(__file__).parent.parent
# An import in formatted code, which spans several lines only in brackets. Parsing only imports takes a sixth of the time.
_IMPORT = re.compile(rb"^[ \t]*((?:from [\w.]+ )?import (?:\([^)]*\)|[^\n(]+))", re.MULTILINE)
# The packages that make problems from scenes, which determine every run. Some of their modules are loaded by name, without imports.
_BEFORE = ("foundations", "io", "effects", "geometry", "scenes", "problems")
_MADE_WITH = (
    "numpy",
    "scipy",
    "gmsh",
    "libigl",
    "pytetwild",
    "scikit-fem",
    "numba",
    "dolfinx-solver-real",
    "fenics-dolfinx",
)


def key(scene: str, solver: str, settings: Mapping[str, object]) -> str:
    """A hash of 16 digits over the key of a ``scene``, the ``solver``, ``settings`` that change results, and :func:`code_hash`."""
    parts = [scene, solver, json.dumps(settings, sort_keys=True), code_hash(solver)]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


@cache
def code_hash(solver: str, package: Path = PACKAGE) -> str:
    """A hash of 16 digits over the source files in ``package`` that determine the runs of ``solver``."""
    digest = hashlib.sha256()
    for path in sorted(sources(solver, package)):
        digest.update(str(path.relative_to(package)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def sources(solver: str, package: Path = PACKAGE) -> set[Path]:
    """The files that determine the runs of ``solver``: the packages that make problems, the modules of the solver, and the modules
    that any of these import, directly or indirectly.
    """
    found = {path for name in _BEFORE for path in _files(package / name)}
    waiting = _module(package, ["solvers", solver]) | {path for path in found if path.suffix == ".py"}
    while waiting:
        found |= waiting
        modules = {module for path in waiting if path.suffix == ".py" for module in imported(path, package)}
        waiting = {path for module in modules for path in _module(package, module.split("."))} - found
    return found


@cache
def imported(path: Path, package: Path) -> tuple[str, ...]:
    """The names that the file at ``path`` imports from ``package``, without the name of the package. These are modules, and members
    that may be modules.
    """
    start, found = f"{package.name}.", list[str]()
    for node in ast.walk(_tree(path.read_bytes())):
        if isinstance(node, ast.Import):
            found += [alias.name.removeprefix(start) for alias in node.names if alias.name.startswith(start)]
        elif isinstance(node, ast.ImportFrom):
            here = [package.name, *path.parent.relative_to(package).parts]
            base = here[: len(here) + 1 - node.level] if node.level else []
            whole = ".".join([*base, *([node.module] if node.module else [])])
            if f"{whole}.".startswith(start):
                inside = whole.removeprefix(package.name).removeprefix(".")
                found += [inside, *(f"{inside}.{alias.name}".lstrip(".") for alias in node.names)]
    return tuple(found)


def _tree(source: bytes) -> ast.AST:
    """The syntax tree of the imports in a ``source``, or of the entire source if something else looks like an import."""
    try:
        return ast.parse(b"\n".join(_IMPORT.findall(source)))
    except SyntaxError:
        return ast.parse(source)


def machine() -> str:
    """A description of the machine on which this process runs."""
    return f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores"


def made_with(manner: str = "") -> dict[str, str]:
    """The provenance of a measurement: the version of fem_reference, the machine, and the versions of packages. ``manner``: a text
    on how runs use the machine.
    """
    described = ", ".join(filter(None, [machine(), manner]))
    return {"fem_reference": __version__, "machine": described, **versions()}


def versions() -> dict[str, str]:
    """The versions of Python and of the packages on which a run may depend."""
    return {"python": platform.python_version(), **version.versions(_MADE_WITH)}


def _files(folder: Path) -> set[Path]:
    return {path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts}


def _module(package: Path, parts: list[str]) -> set[Path]:
    """The files of the module with the path ``parts`` in ``package``; for a solver in a folder, all files in the folder. They
    include each ``__init__.py`` of the packages around the module, except that of ``package``, which only lists public names. Empty
    if there is no such module.
    """
    place = package.joinpath(*parts)
    if place.is_dir():
        solver = len(parts) == 2 and parts[0] == "solvers"
        own = _files(place) if solver else {place / "__init__.py"}
    else:
        own = {place.with_suffix(".py")} if parts else set()
    above = {package.joinpath(*parts[:n], "__init__.py") for n in range(1, len(parts))}
    return {path for path in own | above if path.is_file()}
