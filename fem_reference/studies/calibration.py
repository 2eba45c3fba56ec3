"""Fits the parameters of a case to measured forces, lengths and places, by runs of its reference."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fem_reference.assessment import calibration
from fem_reference.assessment.calibration import Calibration, Row
from fem_reference.assessment.uncertainty import Parameter
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.metrics import Measure, change, context_of, find, units
from fem_reference.problems import of_case
from fem_reference.runs.store import Run
from fem_reference.scenes import numbers
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import fenicsx
from fem_reference.studies.campaign import Workers, carry_out, shared_bench
from fem_reference.studies.uncertainty import parameters_of
from fem_reference.studies.variations import Trial

_AXES = ("x", "y", "z")
_WANT = "METRIC.STATISTIC, force.BONE, force.BONE.x, or position.VERTEX.x"


def calibrate(case: MuscleCase, data: Path, keys: Sequence[str], store: Path, workers: Workers) -> Calibration:
    """The numbers of a case at ``keys``, within their ranges, fitted to the measurements in a CSV file by runs of the reference."""
    case = of_case.chosen(case).model_copy(update={"choice": "listed", "decisions": (), "candidate": ()})
    parameters = chosen(case, keys)
    rows = calibration.read(data, lambda quantity, place: unit_of(case, quantity, place))
    for row in rows:
        if row.frame not in case.numbers:
            want = f"one of the case: {case.numbers[0]} to {case.numbers[-1]}, every {case.frames.every}"
            raise InputError(f"{row.place}: frame", str(row.frame), want)

    def forward(points: Sequence[Floats]) -> list[Floats]:
        values = [{one.key: one.at(float(at)) for one, at in zip(parameters, point, strict=True)} for point in points]
        return [_asked(case, run, rows, store) for run in _runs(case, values, store, workers)]

    with fenicsx.shared():
        return calibration.fit(forward, parameters, rows, case.name)


def chosen(case: MuscleCase, keys: Sequence[str]) -> tuple[Parameter, ...]:
    """The parameters at ``keys``, each with a range; InputError where one has none."""
    known = {one.key: one for one in parameters_of(case)}
    for key in keys:
        numbers.number(case, key)
        if key not in known:
            want = f"a key with a range ({', '.join(known)}), or one in [[uncertain]] of the case"
            raise InputError("--fit", f'"{key}", which has no range', want)
    if not keys:
        raise InputError("--fit", "nothing", f"one of {', '.join(known)}")
    return tuple(known[key] for key in dict.fromkeys(keys))


def unit_of(case: MuscleCase, quantity: str, place: str) -> str:
    """The unit of a quantity that a run of the case may have; InputError at ``place`` where it has no such one."""
    kind, name, axis = _split(quantity)
    bones = [bone.name for bone in case.bone]
    if kind == "force":
        if name in bones:
            return "N"
        raise InputError(place, f'"{quantity}"', f"force.BONE or force.BONE.x, of one of {', '.join(bones)}")
    if kind == "position" and name.isdecimal() and axis:
        return "mm"
    known = units(of={"surface", "lines"}, against={"reference"})
    if quantity not in known:
        metrics = ", ".join(sorted({one.partition(".")[0] for one in known}))
        raise InputError(place, f'"{quantity}"', f"{_WANT}; metrics are {metrics}")
    return known[quantity]


def _split(quantity: str) -> tuple[str, str, str]:
    """The kind of a quantity, its name, and its axis, empty where it has none.

    >>> _split("force.femur.x"), _split("force.femur"), _split("fibre_length.mean")
    (('force', 'femur', 'x'), ('force', 'femur', ''), ('fibre_length', 'mean', ''))
    """
    kind, _, rest = quantity.partition(".")
    name, _, axis = rest.rpartition(".")
    return (kind, name, axis) if name and axis in _AXES else (kind, rest, "")


def _runs(case: MuscleCase, values: Sequence[dict[str, float]], store: Path, workers: Workers) -> list[Run]:
    """The runs of the case with other ``values`` by key; InputError where one does not reach all frames."""
    said = [", ".join(f"{key} {value:.6g}" for key, value in one.items()) for one in values]
    trials = [
        Trial(numbers.changed(case, one), case.reference, "reference", "fit", words)
        for one, words in zip(values, said, strict=True)
    ]
    runs = list[Run]()
    for made in carry_out(trials, store, workers):
        if made.reached is None:
            got = f"a run that {': '.join(made.ended)} (at {made.trial.value})"
            raise InputError("calibrate", got, "ranges of parameters in which the reference reaches all frames")
        runs.append(made.reached)
    return runs


def _asked(case: MuscleCase, run: Run, rows: Sequence[Row], store: Path) -> Floats:
    """The values (m,) of a ``run`` that the ``rows`` ask for."""
    context = context_of(shared_bench(case, store).setup(), run)
    changes = change(run, context, sorted({row.quantity.partition(".")[0] for row in rows} - {"force", "position"}))
    return np.array([_value(run, row, changes) for row in rows])


def _value(run: Run, row: Row, changes: Sequence[Measure]) -> float:
    """The value of a ``run`` at the frame of a ``row``, a statistic among its ``changes`` from rest."""
    kind, name, axis = _split(row.quantity)
    i = run.numbers.index(row.frame)
    if kind == "force":
        force = run.force(name)[i]
        return float(force[_AXES.index(axis)] if axis else np.linalg.norm(force))
    if kind == "position":
        if int(name) >= len(run.surface.points):
            want = f"one of the {len(run.surface.points)} of the surface"
            raise InputError(f"{row.place}: quantity", f"vertex {name}", want)
        return float(run.positions[i, int(name), _AXES.index(axis)])
    measure = find(changes, kind, name)
    if measure is None:
        raise InputError(f"{row.place}: quantity", f'"{row.quantity}"', "one that this case has")
    return float(measure.values[i])
