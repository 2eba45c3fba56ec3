"""Runs of hard cases, followed frame by frame as their health is measured."""

from dataclasses import replace

import numpy as np

from fem_reference import solvers
from fem_reference.assessment import second_check
from fem_reference.assessment.health import Followed
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.geometry.embedding import Locator
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.of_case import CaseProblem
from fem_reference.problems.problem import NO_SURFACE
from fem_reference.problems.scalar import FieldProblem
from fem_reference.runs.states import VALUES
from fem_reference.runs.store import Frame, Outcome
from fem_reference.scenes.case import SolverChoice
from fem_reference.solvers.common.protocol import MuscleSolver
from fem_reference.studies.hard.records import task_of
from fem_reference.studies.hard.repeats import check_not_stalled

_MOST_FOR_SECOND = 200  # tetrahedra, for which it takes seconds


def follow(built: CaseProblem, choice: SolverChoice) -> tuple[Outcome, Followed]:
    """Solve a problem by a solver; InputError where that is not for it, StalledError where the machine was too busy."""
    solver, task, muscle = choice.solver, task_of(choice.solver, built.task), built.muscle
    as_body = muscle is not None and task == "solve_body"
    offer = solvers.find(solver, solver, task)
    if isinstance(offer, MuscleSolver) and offer.moves not in ("surface", "tetrahedra"):
        want = "one that moves a surface, which health is of"
        raise InputError(solver, f"a solver that moves {offer.moves}", want)
    if muscle and as_body and len(muscle.mesh.tets) > _MOST_FOR_SECOND:
        want = f"at most {_MOST_FOR_SECOND}: it is written in Python, to be right and not fast"
        raise InputError(solver, f"{len(muscle.mesh.tets)} tetrahedra", want)
    settings = solvers.settings(choice, solver, task)
    solvers.check(solver, settings, muscle.effects if muscle else (), solver, task)
    solvers.require(solver, settings, solver, task)
    frames = list[Frame]()
    outcome = offer.solve(built.body if as_body else built, settings, frames.append)
    check_not_stalled(outcome)
    if built.field is not None:
        return outcome, _of_field(built.field, frames)
    assert muscle is not None  # what is no field
    rest, mesh = muscle.surface.points, muscle.mesh
    if as_body:  # whose surface goes along with the tetrahedra
        inside = Locator(mesh).embed(rest)
        frames = [replace(one, surface=rest + inside.interpolate(mesh, one.points - mesh.points)) for one in frames]
    if solvers.takes_effects(solver):
        outcome = second_check.confirmed_frames(muscle, frames, outcome, settings)
    return outcome, _of_muscle(muscle, frames or [Frame(muscle.frames[0], np.array(rest))])


def _of_field(field: FieldProblem, frames: list[Frame]) -> Followed:
    """The values of a scalar field, and the range of those on its boundary."""
    values = np.array([frame.field.arrays[VALUES] for frame in frames if frame.field])
    boundary = field.fixed[np.isfinite(field.fixed)]
    return Followed((0,), NO_SURFACE, np.zeros((1, 0, 3)), values=values, range=(boundary.min(), boundary.max()))


def _of_muscle(built: MuscleProblem, frames: list[Frame]) -> Followed:
    tets = [frame.points for frame in frames if len(frame.points)]
    whole = len(tets) == len(frames)

    def scalar(name: str) -> Floats | None:
        """A scalar of all frames (f,), None where not all have it."""
        found = [frame.scalars[name] for frame in frames if name in frame.scalars]
        return np.array(found) if len(found) == len(frames) else None

    determinants = [scalar("min_det_F_quadrature"), scalar("min_det_F_vertices")]
    known = [one for one in determinants if one is not None]
    return Followed(
        tuple(int(frame.number) for frame in frames),
        built.surface,
        np.array([frame.surface for frame in frames if frame.surface is not None]),
        built.mesh if whole else None,
        np.array(tets) if whole else None,
        built.bones,
        built.free,
        integrated=scalar("volume_ratio"),
        negative_modes=scalar("negative_modes"),
        material_modes=scalar("material_modes"),
        least_determinant=np.min(known, axis=0) if known else None,
    )
