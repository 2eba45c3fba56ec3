"""Checks of the arguments of the Python API before any work begins; each error names its argument."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.error_bars import ErrorBars
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.given import path, said
from fem_reference.runs.store import Run
from fem_reference.scenes.case import Case
from fem_reference.scenes.muscles import MusclesCase


def check[T](given: object, kind: type[T], place: str, want: str) -> T:
    """Return the ``given`` argument. Raises InputError at ``place`` unless it is an instance of ``kind``."""
    if not isinstance(given, kind):
        raise InputError(place, said(given), want)
    return given


def check_case(case: object) -> Case:
    """Return the ``case``. Raises InputError unless it is a Case."""
    return check(case, Case, "case", "a Case, such as load_case returns")


def is_of_body(reference: object, of: object) -> bool:
    """True if ``reference`` is a run of the body ``of``. Raises InputError if it is a run of another body."""
    if not isinstance(reference, Run) or reference.body is None:
        return False
    if reference.body is not of:
        raise InputError("reference", "a solution of another body", "what solve_body returned for this body")
    return True


def check_muscle(name: object, case: object, place: str = "muscle") -> None:
    """Raise InputError at ``place`` unless ``name`` is a muscle of the ``case``, or empty if the case does not have several."""
    names = [one.name for one in case.muscle] if isinstance(case, MusclesCase) else []
    if name not in (names or [""]):
        got = f'"{name}"' if isinstance(name, str) else said(name)
        raise InputError(place, got, f"one of {', '.join(names)}" if names else "none for this case")


def check_keys(keys: object) -> Sequence[str]:
    """Return the ``keys``. Raises InputError unless they are a list of strings."""
    if not isinstance(keys, Sequence) or isinstance(keys, str) or not all(isinstance(key, str) for key in keys):
        raise InputError("fit", said(keys), 'a list of keys, such as ["effect[0].mu"]')
    return keys


def check_changes(changes: object) -> None:
    """Raise InputError unless ``changes`` maps keys to values or is None."""
    keys = () if changes is None else tuple(changes) if isinstance(changes, Mapping) else (None,)
    if not all(isinstance(key, str) for key in keys):
        raise InputError("changes", said(changes), 'values by key, such as {"frames.last": 10}')


def check_solver(solver: object, settings: Mapping[str, object], muscle: str = "") -> None:
    """Raise InputError unless ``solver`` is a name, a function or None; with ``settings`` or a ``muscle`` it cannot be None."""
    if solver is None and muscle:
        raise InputError("muscle", said(muscle), "a solver for it, as the reference solves all muscles together")
    if solver is not None and not isinstance(solver, str) and not hasattr(solver, "__name__"):
        raise InputError("solver", said(solver), "the name of a solver, a function, or None")
    if solver is None and settings:
        want = 'the name of their solver, such as solver="fenicsx"'
        raise InputError(f"settings {', '.join(settings)}", "no solver", want)


def free_folder(given: object, place: str) -> Path:
    """The path ``given`` for a folder. Raises InputError at ``place`` unless the folder exists or can be made."""
    folder = path(given, place)
    above = next(one for one in (folder, *folder.absolute().parents) if one.exists())
    if not above.is_dir():
        raise InputError(place, f"{folder}, while {above} is a file", "a folder")
    return folder


def check_comparison(comparison: object) -> Comparison:
    """Return the ``comparison``. Raises InputError unless it is a Comparison."""
    return check(comparison, Comparison, "comparison", "a Comparison, such as compare returns")


def check_error_bars(bars: object, case: Case) -> None:
    """Raise InputError unless ``bars`` are error bars of a reference of the ``case``, or None."""
    if bars is None:
        return
    known = check(bars, ErrorBars, "error_bars", "ErrorBars, such as error_bars returns, or None")
    if known.numbers != case.numbers:
        want = f"bars of frames {case.numbers}, those of the case"
        raise InputError("error_bars", f"bars of frames {known.numbers}", want)


def check_run(given: object, case: Case, place: str) -> None:
    """Raise InputError unless ``given`` is a run of the same kind as the ``case`` (muscle or field). If the run names the case that
    it solved, it must name this ``case``.
    """
    run = check(given, Run, place, "a Run, such as solve and read_run return")
    scene, effects, place = run.origin.get("scene"), run.origin.get("effects"), f'{place} "{run.name}"'
    keys = {case.key}
    if case.decisions and isinstance(effects, Mapping):  # effects that were not needed were left out of the run
        acting = tuple(one.effect for one in case.decisions if one.effect.title in effects)
        keys.add(case.model_copy(update={"effect": acting}).key)
    if scene is not None and scene not in keys:
        got = f'a run of another case ("{run.origin.get("case", "without a name")}")'
        raise InputError(place, got, f'a run of "{case.name}" with all its keys unchanged')
    if run.carries.isdisjoint(case.carries):
        got, want = (", ".join(sorted(parts)) for parts in (run.carries, case.carries))
        raise InputError(place, f"a run of {got}", f"a run of {want}")


def check_runs(reference: Run, candidates: object, case: Case) -> None:
    """Raise InputError if runs cannot be compared because they solve another case, share a name, or differ in their vertices."""
    check_run(reference, case, "reference")
    if not isinstance(candidates, Sequence) or isinstance(candidates, str | bytes):
        raise InputError("candidates", said(candidates), "a list of runs")
    for run in candidates:
        check_run(run, case, "candidate")
    names = [run.name for run in (reference, *candidates)]
    for run in candidates:
        if names.count(run.name) > 1:
            raise InputError("candidates", f'the name "{run.name}" twice', "runs of different names")
        if run.positions.shape[1:] != reference.positions.shape[1:]:
            got, want = (f"{one.positions.shape[1]} vertices" for one in (run, reference))
            raise InputError(f'candidate "{run.name}"', got, f"the {want} of the reference: a run of the same case")
        if np.shape(run.points) != np.shape(reference.points):
            raise InputError(f'candidate "{run.name}"', f"{len(run.points)} points", f"{len(reference.points)} points")
