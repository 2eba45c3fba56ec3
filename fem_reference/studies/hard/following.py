"""Runs of hard cases, with their frames for measures of health; and repetitions with other load steps or on other meshes."""

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fem_reference import solvers
from fem_reference.assessment import second_check
from fem_reference.assessment.health import Followed
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, diagonal
from fem_reference.geometry.embedding import Locator
from fem_reference.problems.of_case import CaseProblem, MechanicalProblem, at_frames, effects_of, mechanical
from fem_reference.problems.problem import NO_SURFACE
from fem_reference.runs.states import VALUES
from fem_reference.runs.store import Frame, Outcome
from fem_reference.scenes import casefile
from fem_reference.scenes.case import SolverChoice
from fem_reference.solvers import fenicsx
from fem_reference.solvers.common.protocol import MuscleSolver
from fem_reference.studies.hard.records import REFERENCE, SECOND, Hard, Lattice, StepCounts, task_of

_MOST_FOR_SECOND = 200  # the maximum number of tetrahedra for scikit-fem, which solves that many within seconds
SAME = 0.01  # the maximum distance, in % of the body's size, between two states that count as the same
_CUTS = 64  # the maximum factor by which a load step is reduced before the run ends as failed
MOVED = 0.1  # the maximum random displacement of the points of a block, in cell sizes
SIZES = 0.03  # the maximum relative change of the tetrahedron size of a shipped case
LONGEST = 60.0  # the maximum processor time [s] of a run that is repeated on other meshes

Solve = Callable[[Hard], tuple[Outcome, Followed]]


class StalledError(Exception):
    """Raised if the machine was too busy for a conclusion about a run."""


def check_not_stalled(outcome: Outcome) -> None:
    """Raise StalledError if the ``outcome`` is that of a run on a machine that was too busy."""
    if outcome.status == "stalled":
        raise StalledError(outcome.message)


def follow(built: CaseProblem, choice: SolverChoice) -> tuple[Outcome, Followed]:
    """Solve a problem, and return the outcome and the frames for measures of health.

    Raises InputError if the problem does not suit the solver, and StalledError if the machine was too busy.
    """
    solver, task, muscle = choice.solver, task_of(choice.solver, built.task), mechanical(built)
    as_body = muscle is not None and task == "solve_body"
    offer = solvers.find(solver, solver, task)
    if muscle is not None and muscle.spans and solver not in (REFERENCE, SECOND):
        raise InputError(solver, "a solver of a single body", "a solver of several bodies")
    if isinstance(offer, MuscleSolver) and offer.moves not in ("surface", "tetrahedra"):
        want = "a solver that moves a surface, whose health is measured"
        raise InputError(solver, f"a solver that moves {offer.moves}", want)
    tets = 0 if muscle is None or muscle.rest.mesh is None else len(muscle.rest.mesh.tets)
    if as_body and tets > _MOST_FOR_SECOND:
        want = f"at most {_MOST_FOR_SECOND}: this solver is written in Python, for correctness and not for speed"
        raise InputError(solver, f"{tets} tetrahedra", want)
    settings = solvers.settings(choice, solver, task)
    solvers.check(solver, settings, effects_of(muscle) if muscle else (), solver, task)
    solvers.find(solver, solver, task).require(settings)
    frames = list[Frame]()
    outcome = offer.solve(built.body if as_body else built, settings, frames.append)
    check_not_stalled(outcome)
    if built.field is not None:
        values = np.array([frame.field.arrays[VALUES] for frame in frames if frame.field])
        boundary = built.field.fixed[np.isfinite(built.field.fixed)]
        span = boundary.min(), boundary.max()
        return outcome, Followed((0,), NO_SURFACE, np.zeros((1, 0, 3)), values=values, range=span)
    assert muscle is not None  # the problem is not one of a field
    rest, mesh = muscle.rest.surface.points, muscle.rest.mesh
    if as_body and mesh is not None:  # a body, whose surface moves with its tetrahedra
        inside = Locator(mesh).embed(rest)
        frames = [replace(one, surface=rest + inside.interpolate(mesh, one.points - mesh.points)) for one in frames]
    if solvers.takes_effects(solver):
        outcome = second_check.confirmed_frames(muscle, frames, outcome, settings)
    return outcome, _of_muscle(muscle, frames or [Frame(muscle.frames[0], np.array(rest))])


def _of_muscle(built: MechanicalProblem, frames: list[Frame]) -> Followed:
    tets = [frame.points for frame in frames if len(frame.points)]
    whole = len(tets) == len(frames)

    def scalar(name: str) -> Floats | None:
        """The values (f,) of a scalar in all frames; None if a frame lacks the scalar."""
        found = [frame.scalars[name] for frame in frames if name in frame.scalars]
        return np.array(found) if len(found) == len(frames) else None

    volumes = [one for span in built.spans if (one := scalar(f"{span.name}.volume_ratio")) is not None]
    determinants = [scalar("min_det_F_quadrature"), scalar("min_det_F_vertices")]
    known = [one for one in determinants if one is not None]
    return Followed(
        tuple(int(frame.number) for frame in frames),
        built.rest.surface,
        np.array([frame.surface for frame in frames if frame.surface is not None]),
        built.rest.mesh if whole else None,
        np.array(tets) if whole else None,
        built.bones,
        built.free,
        integrated=np.stack(volumes, axis=1) if volumes else None if built.spans else scalar("volume_ratio"),
        negative_modes=scalar("negative_modes"),
        material_modes=scalar("material_modes"),
        least_determinant=np.min(known, axis=0) if known else None,
        spans=built.spans,
    )


@dataclass(frozen=True)
class SameEnd:
    """A comparison of runs that should end alike: ``same`` is True if they do, and ``sentence`` states the result in words."""

    same: bool
    sentence: str


def farthest(followed: Followed) -> StepCounts | None:
    """The default numbers of load steps, up to the frame at which a run is farthest from its first state; None if nothing moved."""
    moved = np.linalg.norm(followed.positions[1:] - followed.positions[0], axis=2).max(axis=1, initial=0.0)
    return StepCounts(until=followed.numbers[1 + int(np.argmax(moved))]) if len(moved) and moved.max() > 0 else None


def in_steps(built: MechanicalProblem, choice: SolverChoice, steps: StepCounts) -> SameEnd:
    """Solve the reference up to a frame with several numbers of equal load steps. Compare the end states with that after the
    largest number of steps with which the frame was reached.
    """
    ends, words, span = dict[int, Floats](), list[str](), steps.until - built.frames[0]
    for count in steps.counts:
        step = {"first_step": span / count, "largest_step": span / count, "smallest_step": span / count / _CUTS}
        settings, frames = fenicsx.Settings(**{**choice.settings, **step}), list[Frame]()
        outcome = fenicsx.solve(at_frames(built, (built.frames[0], steps.until)), settings, frames.append)
        check_not_stalled(outcome)
        if outcome.status == "converged":
            ends[count] = frames[-1].points
        else:
            words.append(f"{count}: {outcome.status}")
    if not ends:
        return SameEnd(True, f"no number of load steps reaches frame {steps.until} ({', '.join(words)})")
    standard, size = ends[max(ends)], diagonal(built.rest.surface.points)
    off = {count: 100 * float(np.linalg.norm(end - standard, axis=1).max()) / size for count, end in ends.items()}
    whence = f"% of the body's size from the end state with {max(ends)} load steps"
    apart = [f"{count}: {share:.2g} {whence}" for count, share in off.items() if count != max(ends)]
    listed = ", ".join(apart + words) or "only one"
    return SameEnd(max(off.values()) <= SAME, f"end state at frame {steps.until} by number of load steps: {listed}")


def jittered(hard: Hard, number: int) -> Hard:
    """The case on a jittered mesh, which the seed ``number`` determines."""
    if hard.block is not None:
        others = [one.model_copy(update={"block": _shaken(one.block, number)}) for one in hard.beside]
        return hard.model_copy(update={"block": _shaken(hard.block, number), "beside": tuple(others)})
    shipped = hard.shipped
    assert shipped is not None  # a Hard record has either a block or a shipped case
    size = casefile.muscle(shipped.read()).muscle.tet_size
    share = 1 + SIZES * np.random.default_rng(number).uniform(-1, 1)
    changed = shipped.changes | {"muscle.tet_size": f"{share * float(size)!r} mm"}
    return hard.model_copy(update={"shipped": shipped.model_copy(update={"changes": changed})})


def _shaken(block: Lattice, number: int) -> Lattice:
    return block.model_copy(update={"jitter": max(block.jitter, MOVED), "seed": number})


def on_meshes(hard: Hard, first: tuple[Outcome, Followed], count: int, solve: Solve) -> SameEnd:
    """Solve a case on ``count`` jittered meshes with the function ``solve``, and compare the statuses, and the positions in common
    frames, with those of the ``first`` run.
    """
    begin, elsewhere, outcome, followed = time.process_time(), 0.0, *first
    ended, off, reached = Counter[str](), list[float](), list[int]()
    for number in range(1, count + 1):
        try:
            other, found = solve(jittered(hard, number))
        except InputError as error:
            if not ended:
                return SameEnd(True, f"no run on other meshes: {error}")
            ended["refused"] += 1
            continue
        ended[other.status] += 1
        elsewhere += other.cost.get("seconds_processor", 0.0)
        reached.append(found.numbers[-1])
        off.append(_apart(followed, found))
        if time.process_time() - begin + elsewhere > LONGEST * number:
            return SameEnd(True, f"no runs on other meshes, as one takes more than {LONGEST:g} s")
    words = ", ".join(f"{many} {status}" for status, many in ended.most_common())
    if off:
        words += f", up to frame {' to '.join(map(str, sorted({min(reached), max(reached)})))}"
        words += f", apart by {max(off):.2g} % at most, {np.median(off):.2g} % in the median"
    statuses = set(ended) - {"refused"}
    alike = statuses <= {"converged"} if outcome.status == "converged" else "converged" not in statuses
    return SameEnd(alike, f"on other meshes: {words}")


def _apart(one: Followed, other: Followed) -> float:
    """The maximum distance between two runs over their common frames [% of the body's size]."""
    both, off = min(len(one.numbers), len(other.numbers)), list[float]()
    for first, second in zip(one.bodies, other.bodies, strict=True):
        moved = second.positions[:both]
        if second.mesh is not None and second.nodes is not None:
            at = Locator(second.mesh).embed(first.surface.points)
            moved = np.array([at.interpolate(second.mesh, nodes) for nodes in second.nodes[:both]])
        off.append(float(np.linalg.norm(first.positions[:both] - moved, axis=2).max()))
    return 100 * float(np.max(off)) / one.size
