# The public names, for editors and type checkers; ``__init__.py`` finds them here when they are asked for.
from fem_reference.assessment.calibration import Calibration
from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.error_bars import ErrorBars
from fem_reference.effects import make as make_effect
from fem_reference.foundations.errors import InputError, MissingSoftware
from fem_reference.foundations.version import __version__ as __version__
from fem_reference.problems.body import Body, Cells, Prescribed
from fem_reference.problems.shapes import box, joined
from fem_reference.problems.touching import Touching
from fem_reference.runs.store import Run
from fem_reference.scenes.case import Case
from fem_reference.scenes.casefile import cases
from fem_reference.scenes.made import make_case
from fem_reference.studies.calibration import calibrate_case as calibrate
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

__all__ = [
    "Body",
    "Calibration",
    "Case",
    "Cells",
    "Comparison",
    "ErrorBars",
    "InputError",
    "MissingSoftware",
    "Prescribed",
    "Run",
    "Touching",
    "box",
    "calibrate",
    "cases",
    "compare",
    "error_bars",
    "export_case",
    "export_runs",
    "joined",
    "load_case",
    "make_case",
    "make_effect",
    "read_run",
    "solve",
    "solve_body",
    "write_report",
]
