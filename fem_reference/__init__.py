"""A finite element reference and validation suite for muscle deformation.

    import fem_reference as fr

    case = fr.load_case("hip_flexion")                    # a shipped case, or a folder with a case.toml
    reference = fr.solve(case, progress=print)            # a Run: positions (f, n, 3) [mm], outcome
    mine = fr.read_run("my_frames", case)                 # frames that another program wrote
    bars = fr.error_bars(case, reference)                 # how far the reference may be from the truth
    result = fr.compare(case, reference, [mine], error_bars=bars)
    print(result[mine.name, "surface_deviation", "rms"].values.max())  # [mm]
    fr.write_report(result, "my_report")

Importing it does nothing. Units are mm, N, MPa, s and rad everywhere; only scene files carry other units, as text.
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fem_reference.assessment.comparison import Comparison
    from fem_reference.assessment.error_bars import ErrorBars
    from fem_reference.effects import make as make_effect
    from fem_reference.foundations.errors import InputError, MissingSoftware
    from fem_reference.foundations.version import __version__ as __version__
    from fem_reference.problems.body import Body, Cells, Prescribed
    from fem_reference.problems.shapes import box
    from fem_reference.runs.store import Run
    from fem_reference.scenes.case import Case
    from fem_reference.scenes.casefile import cases
    from fem_reference.scenes.made import make_case
    from fem_reference.studies.workflow import (
        compare,
        error_bars,
        export_case,
        export_runs,
        load_case,
        read_run,
        solve,
        solve_body,
        write_report,
    )

if sys.version_info[:2] < (3, 12):  # noqa: UP036 - who imports a checkout has not been asked by pip
    wanted = "fem_reference needs Python 3.12 or newer: python3.12 -m venv .venv, and install it there"
    raise ImportError(f"this is Python {sys.version.split()[0]} ({sys.executable}); {wanted}")

__all__ = [
    "Body",
    "Case",
    "Cells",
    "Comparison",
    "ErrorBars",
    "InputError",
    "MissingSoftware",
    "Prescribed",
    "Run",
    "box",
    "cases",
    "compare",
    "error_bars",
    "export_case",
    "export_runs",
    "load_case",
    "make_case",
    "make_effect",
    "read_run",
    "solve",
    "solve_body",
    "write_report",
]

_WORKFLOW = "fem_reference.studies.workflow"
# Where each public name stands: found when it is asked for, so that importing the package loads nothing.
_PLACES = {
    "Body": ("fem_reference.problems.body", "Body"),
    "Case": ("fem_reference.scenes.case", "Case"),
    "Cells": ("fem_reference.problems.body", "Cells"),
    "Comparison": ("fem_reference.assessment.comparison", "Comparison"),
    "ErrorBars": ("fem_reference.assessment.error_bars", "ErrorBars"),
    "InputError": ("fem_reference.foundations.errors", "InputError"),
    "MissingSoftware": ("fem_reference.foundations.errors", "MissingSoftware"),
    "Prescribed": ("fem_reference.problems.body", "Prescribed"),
    "Run": ("fem_reference.runs.store", "Run"),
    "__version__": ("fem_reference.foundations.version", "__version__"),
    "box": ("fem_reference.problems.shapes", "box"),
    "cases": ("fem_reference.scenes.casefile", "cases"),
    "make_case": ("fem_reference.scenes.made", "make_case"),
    "make_effect": ("fem_reference.effects", "make"),
}


def __getattr__(name: str) -> Any:
    if name not in __dir__():
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, own = _PLACES.get(name, (_WORKFLOW, name))
    return getattr(import_module(module), own)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
