"""A finite element reference and validation suite for muscle deformation.

    import fem_reference as fr

    case = fr.load_case("hip_flexion")                    # a shipped case, or a folder with a case.toml
    reference = fr.solve(case, progress=print)            # a Run: positions (f, n, 3) [mm], outcome
    mine = fr.read_run("my_frames", case)                 # frames that another program wrote
    bars = fr.error_bars(case, reference)                 # how far the reference may be from the truth
    result = fr.compare(case, reference, [mine], error_bars=bars)
    print(result[mine.name, "surface_deviation", "rms"].values.max())  # [mm]
    fr.write_report(result, "my_report")

Modules are loaded when one of their names is first used. Units are mm, N, MPa, s and rad, except in scene files, where each
quantity is written with its unit.
"""

import ast
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

if sys.version_info[:2] < (3, 12):  # noqa: UP036 - pip does not check the version if a checkout is imported
    wanted = "fem_reference needs Python 3.12 or newer: python3.12 -m venv .venv, and install it there"
    raise ImportError(f"this is Python {sys.version.split()[0]} ({sys.executable}); {wanted}")

# The public names, each with its module and its name in that module, read from the stub file next to this file.
_PLACES = {
    alias.asname or alias.name: (node.module or "", alias.name)
    for node in ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")).body
    if isinstance(node, ast.ImportFrom)
    for alias in node.names
}
__all__ = sorted({*_PLACES} - {"__version__"})


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, own = _PLACES[name]
    return getattr(import_module(module), own)


def __dir__() -> list[str]:
    return sorted(_PLACES)
