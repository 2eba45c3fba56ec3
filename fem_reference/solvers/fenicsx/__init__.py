"""The reference: P2 displacement, P1 pressure (Taylor-Hood) on tetrahedra, quasi-static, solved by Newton's method in FEniCSx.

This side needs no FEniCSx. It runs ``worker`` in subprocesses (``mpiexec`` for more than one rank), passes the problem as a file,
and sinks frames as the worker reports them. A worker that dies is the status *crashed*, not an exception.
"""

import logging
import os
import pickle
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.effects import Effect
from fem_reference.foundations import scratch
from fem_reference.foundations.errors import InputError, MissingSoftware
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.foundations.motion import apply
from fem_reference.foundations.records import join
from fem_reference.foundations.subprocesses import command
from fem_reference.geometry.embedding import Locator
from fem_reference.problems.body import Body, check_element, check_quadrature
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.runs.cut_off import CutOff
from fem_reference.runs.store import Frame, Outcome, Sink
from fem_reference.solvers.common.protocol import BodySolver, FieldSolver, MuscleSolver
from fem_reference.solvers.fenicsx import field, resources
from fem_reference.solvers.fenicsx.field import FieldSettings, solve_field
from fem_reference.solvers.fenicsx.jobs import Job, Kept, kept, stored_state
from fem_reference.solvers.fenicsx.processes import require_installed, running
from fem_reference.solvers.fenicsx.session import present, session, shared, solve_body, solve_on
from fem_reference.solvers.fenicsx.settings import BodySettings, Settings

log = logging.getLogger(__name__)

# Ranks that any machine accepts; more only where there are as many cores.
_MOST_RANKS = 8

__all__ = [
    "SOLVES",
    "BodySettings",
    "FieldSettings",
    "Settings",
    "check_effects",
    "require",
    "session",
    "shared",
    "solve",
    "solve_body",
    "solve_field",
]


def require(settings: BodySettings | FieldSettings) -> None:
    """Raise MissingSoftware where FEniCSx is not installed or the requested ranks cannot be started."""
    require_installed()
    if isinstance(settings, Settings):
        _command(settings, Path())


def check_effects(settings: Settings, effects: tuple[Effect, ...], place: str) -> None:
    """Raise InputError below ``place`` unless the element suits tetrahedra and effects, and the ranks suit the linear solver."""
    _check_ranks(settings, join(place, "ranks"))
    check_element(settings.element, "tetrahedron", 1, effects, join(place, "element"))
    check_quadrature(settings.element, settings.quadrature_degree, join(place, "quadrature_degree"))


def solve(problem: MuscleProblem, settings: Settings, sink: Sink) -> Outcome:
    """Solve every requested frame in worker processes; frames carry surface, fibres and tets."""
    require(settings)
    with scratch.folder() as folder:
        return _solve(problem, settings, sink, folder, None)


def go_on(problem: MuscleProblem, settings: Settings, sink: Sink, cut_off: CutOff) -> Outcome:
    """Continue from the last stored frame of a run that was cut off; states are kept until the caller removes them."""
    require(settings)
    there = kept(cut_off, problem.body)
    again = settings.reuse and not any(
        "interval" in effect.needs for effect in problem.body.effects
    )  # states are used again
    if there.frames:
        log.info("begun before; going on from what is kept up to frame %d", there.frames[-1])

    def pass_on(frame: Frame) -> None:
        sink(frame)
        if not again:
            for number in problem.frames[: problem.frames.index(frame.number)]:
                there.place(number).unlink(missing_ok=True)

    return _solve(problem, settings, pass_on, there.folder, there)


def _solve(problem: MuscleProblem, settings: Settings, sink: Sink, folder: Path, kept: Kept | None) -> Outcome:
    body = problem.body
    settings = _planned(_with_states(problem, settings), body)
    job = folder.resolve() / "job.pickle"  # a shared process may have been started elsewhere
    job.write_bytes(pickle.dumps(Job(body, settings, _samples(problem), kept)))
    passed: list[float] = list(kept.frames) if kept else []
    outcome = _solved(job, settings, lambda frame: _pass_on(problem, frame, sink, passed))
    if outcome.status != "converged" and body.frames[0] < body.first and not passed:
        begin = (
            "while what overlaps bones at rest was relaxed, before the first frame (which is shown as it was given): "
        )
        outcome = replace(outcome, message=begin + outcome.message)
    key = " (muscle.tet_size)" if outcome.message.endswith("smaller cells") else ""  # a scene's name of them
    return replace(outcome, message=outcome.message + key, cost={"seconds_mesh": problem.seconds} | outcome.cost)


def _solved(job: Path, settings: Settings, sink: Sink) -> Outcome:
    """Solve the job in a file in the shared process, or else in new processes."""
    own = present() if settings.ranks == 1 else None
    if own is None:
        return _run(_command(settings, job), settings, sink)

    def take(event: dict[str, Any]) -> None:
        sink(_frame(event))
        Path(event["file"]).unlink()

    return own.run(job, settings.time_limit, take, "frames")


def _pass_on(problem: MuscleProblem, frame: Frame, sink: Sink, passed: list[float]) -> None:
    """Sink a requested frame and add its number to ``passed``; frames of the relaxation before the first are dropped."""
    if frame.number in problem.frames:
        if not passed and (overlap := frame.scalars.get("overlap_at_rest", 0.0)) > 0:
            frame = replace(frame, note=f"{frame.note}, {overlap:.2g} mm of overlap with bones at rest removed")
        passed.append(frame.number)
        sink(_with_attachment_errors(problem, frame))


def _with_attachment_errors(problem: MuscleProblem, frame: Frame) -> Frame:
    """The frame with the distance between attached surface vertices and their targets on the bones, ``attachment_error_rms`` and
    ``attachment_error_max`` [mm]. Exact attachments are facets of tets, which cover the vertices only roughly; springs yield.
    The frame is unchanged where nothing is attached.
    """
    surface = frame.surface
    if not problem.attached or surface is None:
        return frame
    off = np.concatenate(
        [
            np.linalg.norm(
                surface[attached.vertices]
                - apply(attached.bone.pose(frame.number), problem.surface.points[attached.vertices]),
                axis=1,
            )
            for attached in problem.attached
        ]
    )
    scalars = {"attachment_error_rms": float(np.sqrt(np.mean(off**2))), "attachment_error_max": float(off.max())}
    return replace(frame, scalars=frame.scalars | scalars)


def _samples(problem: MuscleProblem) -> dict[str, tuple[Ints, Floats]]:
    """Sample points of displacement: by name, the tet of each point and the point at rest, as the map of the tet gives it."""
    locator = Locator(problem.mesh)
    wanted = {"surface": problem.surface.points, "fibres": problem.fibres.points}
    return {name: (locator.embed(points).tets, np.asarray(points)) for name, points in wanted.items()}


def _command(settings: Settings, job: Path) -> list[str]:
    """The worker's command line. The wheel installs its own ``mpiexec`` beside the interpreter; one on the PATH may not fit."""
    # mpi4py's own runner ends all ranks after an error on one; without it the others wait forever.
    worker, mpiexec = command("-m", "mpi4py", "-m", f"{__name__}.worker", str(job)), _mpiexec()
    ranks = settings.ranks or 1
    if ranks == 1:
        return worker
    if ranks > (most := max(_MOST_RANKS, os.cpu_count() or 1)):
        raise InputError("ranks", ranks, f"at most {most} on this machine")
    if mpiexec is None:
        raise MissingSoftware(f"{ranks} ranks need mpiexec, which is neither beside {sys.executable} nor on the PATH")
    return [mpiexec, "-n", str(ranks), *worker]


def _planned(settings: Settings, body: Body) -> Settings:
    """The settings with open ones filled in from the size of ``body`` and the machine."""
    chosen = resources.planned(settings, body.mesh, resources.available())
    _check_ranks(chosen, "ranks")
    if chosen.ranks:
        return chosen
    count = resources.unknowns(body.mesh, chosen.element)
    return chosen.model_copy(update={"ranks": resources.ranks(chosen, count) if _mpiexec() else 1})


def _check_ranks(settings: Settings, place: str) -> None:
    """Raise InputError at ``place`` where multigrid is requested on more than one rank."""
    if settings.linear_solver == "multigrid" and (settings.ranks or 1) > 1:
        raise InputError(place, settings.ranks, "1, on which multigrid works")


def _with_states(problem: MuscleProblem, settings: Settings) -> Settings:
    """The settings with ``store_state`` filled in: as requested, else True where the states of all frames are small."""
    if settings.store_state is not None:
        return settings
    steps = any("interval" in effect.needs for effect in problem.effects)
    size = len(problem.frames) * resources.state(problem.body.mesh, settings.element, steps=steps)
    return settings.model_copy(update={"store_state": size <= resources.MOST_STATES})


def _mpiexec() -> str | None:
    beside = Path(sys.executable).with_name("mpiexec")
    return str(beside) if beside.exists() else shutil.which("mpiexec")


def _run(command_line: list[str], settings: Settings, sink: Sink) -> Outcome:
    reached: list[int] = []
    with running(command_line, settings.time_limit) as worker:
        for event in worker.events():
            if "frame" in event:
                reached.append(event["frame"])
                sink(_frame(event))
                Path(event["file"]).unlink()
            else:
                return Outcome(event["status"], event["message"], event["cost"])
        return worker.ending(f"frames up to {reached[-1]} are kept" if reached else "no frame was reached")


def _frame(event: dict[str, Any]) -> Frame:
    scalars = event["scalars"]
    smallest = min(scalars["min_det_F_quadrature"], scalars["min_det_F_vertices"])
    note = f"{scalars['newton_iterations']:.0f} Newton iterations, det F at least {smallest:.2g}"
    if scalars.get("negative_modes", 0) > 0:
        note += f", unstable equilibrium (negative modes: {scalars['negative_modes']:.0f})"
    if scalars.get("outside_law", 0) > 0:
        note += f", a law outside its range in {scalars['outside_law']:.0f} cells"
    with np.load(event["file"], allow_pickle=False) as arrays:
        pulls = {
            name.replace("force ", "force_"): float(np.linalg.norm(arrays[name]))
            for name in arrays
            if name.startswith("force ")
        }
        for kind in ("force", "moment"):  # of all constraints on the muscle
            sums = [arrays[name] for name in arrays if name.startswith(f"{kind} ")]
            pulls[f"net_{kind}"] = float(np.linalg.norm(np.sum(sums, axis=0)))
        places = arrays["surface"], arrays["fibres"], arrays["nodes"]
        return Frame(
            event["frame"], *places, scalars | pulls, note, stored_state(arrays), residuals=tuple(event["residuals"])
        )


SOLVES = (
    MuscleSolver(
        settings=Settings,
        solve=solve,
        go_on=go_on,
        moves="tetrahedra",
        example={"ranks": 1},
        require=require,
        check_effects=check_effects,
        slow=True,
    ),
    FieldSolver(settings=FieldSettings, solve=field.solve, example={}, require=require, slow=True),
    BodySolver(settings=BodySettings, solve=solve_on, example={}, require=require, slow=True),
)
