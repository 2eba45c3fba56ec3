"""The second check of states that a solver calls converged. A run that it denies has the status ``denied`` and is not a truth."""

import hashlib
import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from fem_reference.assessment import neighbours, run_checks
from fem_reference.assessment.body_balance import balance
from fem_reference.assessment.run_checks import Nodes, RunCheck, RunChecks, of_body, of_muscle, worst
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.records import Record
from fem_reference.geometry import interpenetration
from fem_reference.io.texts import plain
from fem_reference.problems.body import Body
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.muscles import MusclesProblem
from fem_reference.runs import states
from fem_reference.runs.contents import amend
from fem_reference.runs.store import Frame, Outcome, Run, collected
from fem_reference.runs.views import run_of
from fem_reference.runs.writer import places

log = logging.getLogger(__name__)

# The key of the second check in the origin of a run.
RECORD = "second_check"


def confirmed(outcome: Outcome, checks: RunChecks) -> Outcome:
    """The ``outcome``, denied if it is converged and one of the ``checks`` is not met."""
    lost = [str(one) for one in checks if not one.met]
    if not lost or outcome.status != "converged":
        return outcome
    return replace(outcome, status="denied", message=f"denied by the second check: {lost[0]}; {outcome.message}")


def confirmed_run(problem: Callable[[], MuscleProblem | MusclesProblem], run: Run) -> Run:
    """The ``run`` after the second check, with the checks stored in its origin; unchanged if this code has checked it before."""
    sources = b"".join(Path(str(one.__file__)).read_bytes() for one in (run_checks, neighbours, interpenetration))
    stored, code = run.origin.get(RECORD, {}), hashlib.sha256(sources).hexdigest()[:16]
    if stored.get("code") == code:
        return run
    begin, message = time.process_time(), stored.get("message", run.outcome.message)
    whole = replace(run.outcome, status="converged", message=message)
    checks = _of_all(problem(), replace(run, outcome=whole))
    outcome = confirmed(whole, checks)
    facts = [plain(one) | {"met": one.met} for one in checks]
    seconds = time.process_time() - begin
    origin = run.origin | {RECORD: {"code": code, "message": message, "seconds": seconds, "checks": facts}}
    if run.folder is not None:
        amend(run.folder, status=outcome.status, message=outcome.message, origin=origin)
    log.info("%s: second check: %s", run.name, "passed" if outcome.status == "converged" else outcome.message)
    return replace(run, outcome=outcome, origin=origin)


def trusted(problem: Callable[[], MuscleProblem | MusclesProblem], run: Run) -> bool:
    """True for a run that converged, and for a run that ended early if the frames that it reached pass the second check."""
    status = run.outcome.status
    return status == "converged" or (status != "denied" and all(one.met for one in _of_all(problem(), run)))


def _of_all(problem: MuscleProblem | MusclesProblem, run: Run, nodes: Nodes | None = None) -> RunChecks:
    """The checks of a muscle's ``run``, which may have ended early. For several muscles, the checks of each muscle under its name,
    and the check that no muscle is inside another. ``nodes``: the points of the tetrahedra, by default those in the folder of the
    run.
    """
    at = nodes or (lambda number: None if run.folder is None else places(run.folder, number)[1])
    if isinstance(problem, MuscleProblem):
        ended = run.outcome.status != "converged"
        return of_muscle(replace(problem, frames=problem.frames[: len(run.numbers)]) if ended else problem, run, at)
    found = list[RunCheck]()
    for span in problem.spans:
        own = partial(lambda points, number: None if (all_ := at(number)) is None else all_[points], span.points)
        checks = _of_all(problem.problems[span.name], run_of(run, problem, span.name), own)
        found += [replace(one, name=f"{span.name}: {one.name}") for one in checks]
    return (*found, *neighbours.between(problem, run, at, partial(_displacement, run)))


def _displacement(run: Run, number: int) -> Floats | None:
    """The displacement (m, k, 3) [mm] at the nodes of each tetrahedron of a stored ``run``, if its states are stored."""
    if run.folder is None or not states.are_kept(run.folder, (number,)):
        return None
    return states.StoredStates(run.folder, (number,))[number].displacement


def confirmed_frames(
    problem: MuscleProblem | MusclesProblem, frames: Sequence[Frame], outcome: Outcome, settings: Record
) -> Outcome:
    """The ``outcome`` of a run with its ``frames`` in memory, denied if it is converged and does not pass the second check."""
    if outcome.status != "converged":
        return outcome
    run = replace(collected(frames, outcome, problem.rest), origin={"settings": settings.model_dump(mode="json")})
    tets = {frame.number: frame.points for frame in frames if len(frame.points)}
    return confirmed(outcome, _of_all(problem, run, tets.get))


def texts_of(run: Run) -> tuple[str, ...]:
    """The checks stored with a ``run``, in words; checks that deny the run come first. Empty if the run was not checked."""
    found = run.origin.get(RECORD, {}).get("checks", [])
    texts = [str(RunCheck(**{key: value for key, value in one.items() if key != "met"})) for one in found]
    return tuple(text for met in (False, True) for text, one in zip(texts, found, strict=True) if one["met"] is met)


def confirmed_body(body: Body, solved: Run) -> Run:
    """The run ``solved`` of a ``body``, denied if it converged and does not pass the second check."""
    if solved.outcome.status != "converged":
        return solved
    return replace(solved, outcome=confirmed(solved.outcome, (*of_body(body, solved), *worst(balance(body, solved)))))
