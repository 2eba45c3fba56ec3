"""Standings: the reference, our solvers, other people's programs and submitted frames on shared cases. Valid rows are reused."""

import hashlib
import logging
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from fem_reference.assessment import standings
from fem_reference.assessment.solver_table import solver_kinds
from fem_reference.assessment.soundness import unsound
from fem_reference.assessment.standings import ERROR, MATCHED_ERROR, MATCHED_TIME, PROTOCOL, Standing, Standings
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import parse
from fem_reference.foundations.version import __version__
from fem_reference.io import texts
from fem_reference.metrics import MeasurementContext, context_of, in_tables
from fem_reference.runs.key import machine
from fem_reference.runs.store import Run, complete
from fem_reference.scenes.case import COMMAND, Candidate
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import command, recorded
from fem_reference.studies import cost, law_split, refinement, table_5_1
from fem_reference.studies.execution import Bench

log = logging.getLogger(__name__)

# Our own cases, which need no downloaded data, then cases with the report's anatomy in order of cost.
CASES = (
    *("hip_flexion_tendon", "hip_flexion", "box_squeeze"),
    *("adductor_brevis", "gluteus_medius", "iliacus_anatomical", "box_squeeze_report", "gluteus_maximus"),
)
# The default limit of processor time [s] for a solver on a case.
TIME_LIMIT = 600.0
# The entry for the machine in rows of submitted frames.
THEIRS = "as stated by its authors"
# The return of solvers to rest is measured only if the reference is within this distance [mm] (rms) of rest in the last frame.
_BACK = 0.1
# The metrics of all rows; the joint moment is computed only for solvers that provide forces.
_METRICS = (*in_tables(), "joint_moment")


@dataclass(frozen=True)
class Entrant:
    """A solver in standings, and the ``group`` to which it belongs.

    A program may state its ``law`` and the effects that it models (``takes``). Submitted frames belong to a ``case`` (empty: to all
    cases), and state the key of the exported ``scene`` (empty: unknown).
    """

    candidate: Candidate
    group: str
    version: str = __version__
    law: str | None = None
    takes: tuple[str, ...] = ()
    case: str = ""
    scene: str = ""


def program(folder: Path) -> Entrant:
    """The program ``NAME.py`` in a ``folder`` NAME. The settings in its ``candidate.toml`` become options on its command line."""
    file = folder / recorded.ABOUT
    said = parse(command.Description, texts.toml(file), str(file))
    if said.law is not None:
        law_split.check_law(said.law, said.settings.get("poisson"), str(file))
    options = " ".join(f"--{key} {{{key}}}" for key in said.settings)
    words = f"python {folder.resolve().name}.py {options} {{scene}} {{out}}"
    found = command.choice(words, folder.resolve(), str(file))
    return Entrant(found, said.group or table_5_1.FOREIGN, said.version or "", said.law, said.takes)


def submission(folder: Path) -> Entrant:
    """The submitted frames in a ``folder``. The file ``candidate.toml`` there must state case, name, version and the hash of each
    file; otherwise InputError is raised.
    """
    said, place = recorded.about(folder), folder / recorded.ABOUT
    for key in ("case", "name", "version", "sha256"):
        if not getattr(said, key):
            raise InputError(f"{place}: {key}", "nothing", "this key in a submission")
    for path in sorted(folder.iterdir()):
        if path.name != recorded.ABOUT and path.name not in said.sha256:
            raise InputError(f"{place}: sha256", f"no {path.name}", "every file next to it")
    candidate = recorded.choice(folder, None, "--submission")
    return Entrant(
        candidate, said.group or table_5_1.FOREIGN, said.version or "", case=said.case or "", scene=said.scene or ""
    )


def stand(
    scenes: Iterable[MuscleCase],
    store: Path,
    entrants: Sequence[Entrant],
    before: Sequence[Standing],
    only: Collection[str] = (),
    time_limit: float = TIME_LIMIT,
) -> Standings:
    """The standings of our solvers and the ``entrants`` on ``scenes``, with runs in ``store``.

    ``time_limit``: the processor time [s] that a solver may take on a case, whatever its own limit is. ``before``: the rows of
    earlier standings. Rows of other cases are reused; if ``only`` names states (of ``STATES``), rows that are in none of these
    states are reused as well.
    """
    _check_names(entrants)
    limit = {"time_limit": f"{time_limit:g} s"}
    limited = [one.candidate.model_copy(update=limit if one.candidate.solver == COMMAND else {}) for one in entrants]
    entrants = [replace(one, candidate=candidate) for one, candidate in zip(entrants, limited, strict=True)]
    rows, missing, asked = list[Standing](), dict[str, str](), list[str]()
    for scene in scenes:
        asked.append(scene.name)
        known = {row.name: row for row in before if row.case == scene.name}
        try:
            rows += _on(Bench(scene, store, time_limit=time_limit), entrants, known, only, missing)
        except InputError as error:
            missing[scene.name] = str(error)
    for one in entrants:
        if one.case not in ("", *asked):
            missing[f"{one.case}, {one.candidate.name}"] = f"not one of the cases solved here: {', '.join(asked)}"
    done = {row.case for row in rows}
    rows += [row.kept(row.case in missing) for row in before if row.case not in done]
    return Standings(rows=tuple(rows), missing=missing, changes=standings.changes(before, rows))


def _check_names(entrants: Sequence[Entrant]) -> None:
    """Raise InputError if two entrants with the same name have a case in common."""
    cases = dict[str, list[str]]()
    for one in entrants:
        others = cases.setdefault(one.candidate.name, [])
        if others and (one.case in ("", *others) or "" in others):
            raise InputError(one.candidate.name, "two solvers of this name on a case", "different names")
        others.append(one.case)


def _on(
    bench: Bench[MuscleCase],
    entrants: Sequence[Entrant],
    known: dict[str, Standing],
    only: Collection[str],
    missing: dict[str, str],
) -> Iterator[Standing]:
    case, reference = bench.scene, complete(bench.reference(), bench.scene.numbers)
    if reference.outcome.status != "converged":
        got = f"a reference with status {reference.outcome.status}: {reference.outcome.message}"
        raise InputError(case.place, got, "one that reaches all frames")
    measured = _Measured(bench, reference, context_of(bench.setup(), reference), missing)
    truth = Candidate(name="reference", **case.reference.model_dump())
    ours = [Entrant(one, kind) for kind, one, _ in table_5_1.chosen(case, solver_kinds())]
    taken = {truth.name, *(one.candidate.name for one in ours)}
    yield measured.row(Entrant(truth, table_5_1.REFERENCE), reference, measured.truth)
    for one in (*ours, *(one for one in entrants if one.case in ("", case.name))):
        name = one.candidate.name
        try:
            if name in taken and one not in ours:
                raise InputError(name, "the name of one of our solvers", "another name")
            if one.scene not in ("", case.key):
                raise InputError(f"{name}: scene", f'"{one.scene}"', f'"{case.key}", the current key')
            key = measured.key(one)
            old = known.get(name)
            if old is not None:
                limited = old.time_limit in (None, bench.time_limit)
                old = old.model_copy(update={"stale": not (limited and old.is_of(measured.truth, key))})
            if old is not None and not old.asked(only):
                yield old
                continue
            log.info("%s: %s", case.name, name)
            yield measured.row(one, complete(measured.run(one), case.numbers), key)
        except InputError as error:
            missing[f"{case.name}, {name}"] = str(error)


@dataclass(frozen=True, eq=False)
class _Measured:
    """Data that all rows of a case share."""

    bench: Bench[MuscleCase]
    reference: Run
    context: MeasurementContext
    missing: dict[str, str]

    @property
    def truth(self) -> str:
        return "" if self.reference.folder is None else self.reference.folder.name

    def key(self, one: Entrant) -> str:
        """The key of an entrant's run; for submitted frames, a hash of the submission."""
        if one.candidate.solver == "recorded":
            said = recorded.checked_about(Path(one.candidate.settings["folder"]), None)
            return hashlib.sha256(said.model_dump_json().encode()).hexdigest()[:16]
        return self.bench.folder(one.candidate, one.candidate.name).name

    def run(self, one: Entrant) -> Run:
        made = self.bench.read if one.candidate.solver == "recorded" else self.bench.obtain
        return made(one.candidate.name, one.candidate, one.candidate.name)

    def row(self, one: Entrant, run: Run, key: str) -> Standing:
        """The row of a run with this ``key``. A run that took longer than the time limit counts as timed out, even if it was solved
        with another limit.
        """
        own = run is self.reference
        submitted = one.candidate.solver == "recorded"  # then its time was measured on another machine
        limit = None if own or submitted else self.bench.time_limit
        late = limit is not None and run.outcome.cost.get("seconds_processor", 0.0) > limit
        status = "timed out" if late and run.outcome.status == "converged" else run.outcome.status
        worst = {} if own else cost.greatest(run, self.reference, self.context, _METRICS)
        seconds, why = table_5_1.seconds_of(run), "" if own else unsound(run, self.reference)
        error = worst.get(ERROR, np.nan)
        time = np.nan if seconds is None or submitted or why or late else seconds
        return Standing(
            case=self.bench.scene.name,
            group=one.group,
            name=run.name,
            version=one.version,
            status=status,
            message=run.outcome.message,
            unsound=why,
            seconds_per_frame=seconds,
            worst={name: value if np.isfinite(value) else None for name, value in worst.items()},
            bars=cost.known(refinement.stored(run)) if own else {},
            from_rest=_from_rest(run, self.reference),
            split={} if why or own or late else self._split(one, run),
            least_error=error if np.isfinite(error) and time <= MATCHED_TIME else None,
            least_time=time if np.isfinite(time) and error <= MATCHED_ERROR else None,
            truth=self.truth,
            run=key,
            frames=hashlib.sha256(np.ascontiguousarray(run.positions).tobytes()).hexdigest(),
            date=datetime.now(UTC).strftime("%Y-%m-%d"),
            machine=THEIRS if submitted else str(run.origin.get("machine", machine())),
            protocol=PROTOCOL,
            time_limit=limit,
        )

    def _split(self, one: Entrant, run: Run) -> dict[str, float]:
        """The parts of the error of a solver that states its law; empty if its run or an intermediate reference is unfinished."""
        if one.law is None or run.outcome.status != "converged":
            return {}
        try:
            law = law_split.law_of(one.law, self.bench.scene, float(one.candidate.settings["poisson"]))
            return law_split.split(self.bench, run, law, one.takes).parts
        except InputError as error:
            self.missing[f"{self.bench.scene.name}, parts of the error of {run.name}"] = str(error)
            return {}


def _from_rest(run: Run, reference: Run) -> float | None:
    """The distance [mm] (rms) between the first and the last frame of a run; None if the reference does not return to rest."""
    away = [np.sqrt(np.mean(np.sum((one.positions[-1] - one.positions[0]) ** 2, axis=1))) for one in (run, reference)]
    return float(away[0]) if away[1] <= _BACK and np.isfinite(away[0]) else None
