"""Calibration: fit the parameters of a case to measured forces, lengths and positions by solving the case with FEniCSx."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fem_reference.assessment import calibration
from fem_reference.assessment.calibration import Calibration, Measurement
from fem_reference.assessment.uncertainty import Failure, Parameter
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.given import path
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.progress import Progress, reported
from fem_reference.metrics import Measure, change, context_of, find, units
from fem_reference.runs.store import Run
from fem_reference.scenes import casefile, numbers
from fem_reference.scenes.case import Case
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import fenicsx
from fem_reference.studies import arguments
from fem_reference.studies.campaign import Workers, carry_out, shared_bench
from fem_reference.studies.unknowns import Unknowns, unknowns
from fem_reference.studies.variations import Trial
from fem_reference.studies.workflow import STORE

_AXES = ("x", "y", "z")
_WANT = "METRIC.STATISTIC, force.BONE, force.BONE.x, or position.VERTEX.x"


def calibrate_case(
    case: Case, data: str | Path, fit: Sequence[str], *, store: str | Path = STORE, progress: Progress | None = None
) -> Calibration:
    """Fit parameters of a muscle case to measurements. Each trial solves the reference on the mesh of the case.

    ``data``: path of a CSV file with the columns ``frame,quantity,value,unit,sd``; docs/uncertainty.md describes them.
    ``fit``: the keys of the parameters to fit, such as ``"effect[0].mu"``. Each parameter must have a range.

    The returned ``Calibration`` has one entry in ``estimates`` for each parameter: the ``parameter``, the fitted ``value`` and the
    confidence interval from ``low`` to ``high``, in the unit of the parameter. Its property ``holds`` is True if the fit converged,
    the law fits the data, and every parameter is determined and inside its range.
    """
    muscle = casefile.muscle(arguments.check_case(case))
    keys, folder = arguments.check_keys(fit), arguments.free_folder(store, "store")
    with reported(progress):
        return calibrate(muscle, path(data, "data"), keys, folder, Workers())


def calibrate(case: MuscleCase, data: Path, keys: Sequence[str], store: Path, workers: Workers) -> Calibration:
    """Fit the parameters at ``keys``, each within its range, to the measurements in the CSV file ``data``."""
    varied = unknowns(case.model_copy(update={"candidate": ()}))
    case, parameters, lost = varied.case, chosen(varied, keys), list[Failure]()
    rows = calibration.read(data, lambda quantity, place: unit_of(case, quantity, place))
    for row in rows:
        if row.frame not in case.numbers:
            want = f"a frame of the case: {case.numbers[0]} to {case.numbers[-1]}, every {case.frames.every}"
            raise InputError(f"{row.place}: frame", str(row.frame), want)

    def forward(points: Sequence[Floats]) -> list[Floats | None]:
        values = [{one.key: one.at(float(at)) for one, at in zip(parameters, point, strict=True)} for point in points]
        made = _made(varied, values, store, workers)
        lost.extend(one for one in made if isinstance(one, Failure))
        return [None if isinstance(one, Failure) else _values(case, one, rows, store) for one in made]

    with fenicsx.shared():
        found = calibration.fit(forward, parameters, rows, case.name)
    return replace(found, failures=tuple(lost))


def chosen(varied: Unknowns, keys: Sequence[str]) -> tuple[Parameter, ...]:
    """The parameters at ``keys``, each once. Raises InputError if there are no keys, if a parameter has no range, or if a parameter
    belongs to an effect that the case leaves out.
    """
    known = {one.key: one for one in varied.parameters()}
    for key in keys:
        numbers.number(varied.whole, key)
        if not varied.acts(key):
            got = f'"{key}" ({numbers.title(varied.whole, key)}), a parameter of an effect that this case leaves out'
            raise InputError("--fit", got, f'one of {", ".join(known)}, or effects = "listed" in the case')
        if numbers.canonical(key) not in known:
            want = f"a key with a range ({', '.join(known)}), or a range for this key in [[uncertain]] of the case"
            raise InputError("--fit", f'"{key}", which has no range', want)
    if not keys:
        raise InputError("--fit", "nothing", f"one of {', '.join(known)}")
    return tuple(known[key] for key in dict.fromkeys(map(numbers.canonical, keys)))


def unit_of(case: MuscleCase, quantity: str, place: str) -> str:
    """The unit of a measured ``quantity``. Raises an InputError that names ``place`` if the case has no such quantity."""
    kind, name, axis = _split(quantity)
    bones = [bone.name for bone in case.bone]
    if kind == "force":
        if name in bones:
            return "N"
        raise InputError(place, f'"{quantity}"', f"force.BONE or force.BONE.x, where BONE is one of {', '.join(bones)}")
    if kind == "position" and name.isdecimal() and axis:
        return "mm"
    known = units(of={"surface", "lines"}, against={"reference"})
    if quantity not in known:
        metrics = ", ".join(sorted({one.partition(".")[0] for one in known}))
        raise InputError(place, f'"{quantity}"', f"{_WANT}; the metrics are {metrics}")
    return known[quantity]


def _split(quantity: str) -> tuple[str, str, str]:
    """The three parts of a quantity: kind, name and axis. The axis is an empty string if the quantity has none.

    >>> _split("force.femur.x"), _split("force.femur"), _split("fibre_length.mean")
    (('force', 'femur', 'x'), ('force', 'femur', ''), ('fibre_length', 'mean', ''))
    """
    kind, _, rest = quantity.partition(".")
    name, _, axis = rest.rpartition(".")
    return (kind, name, axis) if name and axis in _AXES else (kind, rest, "")


def _made(varied: Unknowns, values: Sequence[dict[str, float]], store: Path, workers: Workers) -> list[Run | Failure]:
    """One run of the case for each set of parameter ``values``, given by key; a ``Failure`` in place of a run without a result."""
    found, trials = dict[int, Run | Failure](), dict[int, Trial]()
    for i, one in enumerate(values):
        said = ", ".join(f"{key} {value:.6g}" for key, value in one.items())
        try:
            trials[i] = Trial(varied.at(one), varied.whole.reference, "reference", "fit", said)
        except InputError as error:
            found[i] = Failure(one, "refused", str(error))
    for i, made in zip(trials, carry_out(list(trials.values()), store, workers), strict=True):
        found[i] = made.reached or Failure(values[i], *made.ended)
    return [found[i] for i in range(len(values))]


def _values(case: MuscleCase, run: Run, rows: Sequence[Measurement], store: Path) -> Floats:
    """The values (m,) that a ``run`` predicts for the m measurements in ``rows``."""
    context = context_of(shared_bench(case, store).setup(), run)
    changes = change(run, context, sorted({row.quantity.partition(".")[0] for row in rows} - {"force", "position"}))
    return np.array([_value(run, row, changes) for row in rows])


def _value(run: Run, row: Measurement, changes: Sequence[Measure]) -> float:
    """The value that a ``run`` predicts for the measurement ``row``.

    ``changes``: measures of the run's change from rest, which supply the value if the quantity is a statistic of a metric.
    """
    kind, name, axis = _split(row.quantity)
    i = run.numbers.index(row.frame)
    if kind == "force":
        force = run.force(name)[i]
        return float(force[_AXES.index(axis)] if axis else np.linalg.norm(force))
    if kind == "position":
        if int(name) >= len(run.surface.points):
            want = f"one of the {len(run.surface.points)} vertices of the surface"
            raise InputError(f"{row.place}: quantity", f"vertex {name}", want)
        return float(run.positions[i, int(name), _AXES.index(axis)])
    measure = find(changes, kind, name)
    if measure is None:
        raise InputError(f"{row.place}: quantity", f'"{row.quantity}"', "a quantity that this case has")
    return float(measure.values[i])
