"""The process that solves: reads pickled jobs, marches each body through its frames, and reports every frame as a line of JSON."""

import gc
import json
import pickle
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.foundations.subprocesses import end_with_starter
from fem_reference.foundations.usage import forget_peak_memory, peak_memory
from fem_reference.problems.problem import Task
from fem_reference.problems.scalar import FieldProblem
from fem_reference.solvers.fenicsx import dolfinx_door  # noqa: F401 - first
from fem_reference.solvers.fenicsx.jobs import Job
from fem_reference.solvers.fenicsx.processes import MARK

from fem_reference.solvers.fenicsx import compiling, assembled_field  # isort: skip - after the door
from fem_reference.solvers.fenicsx.body import AssembledBody  # isort: skip
from fem_reference.solvers.fenicsx.branching import leave  # isort: skip
from fem_reference.solvers.fenicsx.limit_points import ahead  # isort: skip
from fem_reference.solvers.fenicsx.reactions import reactions  # isort: skip
from fem_reference.solvers.fenicsx.restart import Restart  # isort: skip
from fem_reference.solvers.fenicsx.validity import Ranges  # isort: skip
from fem_reference.solvers.common.load_steps import Attempt, Step, StepSizes, march  # isort: skip


_COUNTED = ("factorisations", "factorisation_flops", "krylov_iterations", "halved_steps")


class Worker:
    """One job on all ranks; the first rank reports."""

    def __init__(self, job: Job, folder: Path) -> None:
        """``folder``: where the frames are written."""
        begin = time.perf_counter()
        forget_peak_memory()
        self.began = time.process_time()
        self.job, self.folder, self.settings = job, folder, job.settings
        self.body = AssembledBody(job.body, job.settings)
        self.body.judged = bool(job.samples)
        if job.body.start is not None:
            self.body.start(job.body.start)
        self.set_up = time.perf_counter() - begin
        self.solving = self.solving_processor = self.checking = 0.0
        self.reported = 0.0  # solving_processor, up to the last reported frame
        self.counts = {"newton_iterations": 0, "load_steps": 0, "cut_backs": 0}
        self.unstable: dict[float, tuple[float, float]] = {}  # by frame, negative modes, and those of the material
        self.left: dict[float, float] = {}  # perturbation [mm] by frame
        self.ranges = Ranges()
        self.exact = False  # linear systems are solved exactly after Newton's method failed otherwise
        self.collapse = ""  # the result of attempts since the last good state, where a body collapsed in one
        self.earlier: dict[str, float] = {}  # the cost of earlier processes of this run
        self.restart = Restart(self.body, job.kept) if job.kept else None

    def begin(self) -> tuple[tuple[float, ...], StepSizes]:
        """The frames to march through and the load steps: from rest, or from the frame at which an earlier process was cut
        off.
        """
        frames, settings = self.job.body.frames, self.settings
        first, good = settings.first_step, () if self.restart is None else self.restart.good()
        if self.restart is None or not good:
            self.report_frame(Step(frames[0], size=first))
        else:
            facts = self.restart.go_on(good)
            first, self.earlier = facts["size"], facts["cost"]
            self.unstable = {frame: tuple(modes) for frame, modes in facts["unstable"]}
            self.ranges.know(facts["ranges"])
            if facts["exact"]:
                self.solve_exactly()
            frames = tuple(frame for frame in frames if frame >= good[-1])
        return frames, StepSizes(first, settings.smallest_step, settings.largest_step, self.job.body.stops)

    def run(self) -> None:
        """March through the frames and report how it ended."""
        frames, steps = self.begin()
        for reached in march(self.attempt, frames, steps, self.body.recall, self.solve_exactly):
            for name, count in (
                ("newton_iterations", reached.iterations),
                ("load_steps", reached.steps),
                ("cut_backs", reached.cutbacks),
            ):
                self.counts[name] += count
            if not reached.last.converged:
                status, message = self.failure(reached)
                self.report(status=status, message=message, cost=self.cost())
                return
            self.stabilise(reached.frame)
            self.report_frame(reached)
        wanted = sum(frame >= self.job.body.first for frame in self.job.body.frames)
        message = f"all {wanted} frames reached{self.departures()}{self.instability()}{self.ranges}"
        message += self.restart.note if self.restart else ""
        self.report(status="converged", message=message, cost=self.cost())

    def attempt(self, frame: float) -> Attempt:
        """Solve at ``frame`` from the last state; restore that on failure."""
        begin, processor = time.perf_counter(), time.process_time()
        result = self.body.attempt(frame)
        self.solving += time.perf_counter() - begin
        self.solving_processor += time.process_time() - processor
        if result.status in ("converged", "collapsed"):
            self.collapse = result.detail
        return result

    def solve_exactly(self) -> bool:
        """Solve linear systems exactly from now on; True where that is a change. The residual of an inexact solution moves a
        nearly free body far away.
        """
        other = self.body.linear.solve_exactly()
        self.exact |= other
        return other

    def stabilise(self, frame: float) -> None:
        """Leave an unstable equilibrium of ``frame`` where a stable one is requested."""
        if self.settings.follow == "stable":
            left = leave(self.body, frame, self.settings.perturbation)
            if left is not None:
                self.left[frame] = left

    def departures(self) -> str:
        """The note on equilibria that were left, empty without."""
        if not self.left:
            return ""
        most = max(self.left.values())
        return (
            f"; in {len(self.left)} of them an unstable equilibrium was left along its lowest mode, "
            f"first at frame {min(self.left):g}, by a perturbation of up to {most:.3g} mm"
        )

    def negative_modes(self, frame: float) -> dict[str, float]:
        """The number of directions in which the energy falls from the state of a reached frame, where it can be known; its time
        does not count as solving.
        """
        begin = time.perf_counter()
        modes = self.body.examine(frame)
        own = self.body.modes_of_material() if modes is not None and modes > 0 else modes
        self.checking += time.perf_counter() - begin
        return {} if modes is None or own is None else {"negative_modes": modes, "material_modes": own}

    def instability(self) -> str:
        """The note on unstable states, empty without."""
        if not self.unstable:
            return ""
        most, own = (max(modes) for modes in zip(*self.unstable.values(), strict=True))
        return (
            f"; in {len(self.unstable)} of them the equilibrium is unstable, first at frame {min(self.unstable):g} "
            f"(negative modes: up to {most:.0f}, of which the material has {own:.0f} for certain)"
        )

    def failure(self, reached: Step) -> tuple[str, str]:
        """The status of a run that did not reach a frame, and the reason in words."""
        if self.collapse:
            return "collapsed", self.sentence(reached)
        limit = ahead(self.body, self.settings.smallest_step)
        if limit is None:
            return reached.last.status, self.sentence(reached)
        return "limit point", f"{limit}; {self.sentence(reached)}"

    def sentence(self, reached: Step) -> str:
        """The reason why a frame could not be reached, where, and what to try."""
        other = "a larger bulk modulus" if self.collapse else "smaller cells"
        self.ranges.add(reached.at, self.body.validity.examine(reached.at)[1])
        return (
            f"{self.collapse or reached.last.detail} beyond frame {reached.at:.2f} "
            f"with steps down to {self.settings.smallest_step}; "
            f"in the last good state det F is smallest, {self.body.determinants.smallest()}{self.deepest()}"
            f"{self.instability().replace('of them', 'of the frames reached')}{self.ranges}; "
            f"try a smaller motion or {other}"
        )

    def deepest(self) -> str:
        """The place where contact is deepest, if there is any."""
        contact = self.body.contact
        return f", and contact is deepest, {contact.deepest()}" if contact else ""

    def report_frame(self, reached: Step) -> None:
        """Write the frame's positions and forces beside the job and report it."""
        forces, moments = reactions(self.body.system, self.body.contact, divided=bool(self.job.samples))
        arrays = {name: self.body.positions(*sample) for name, sample in self.job.samples.items()}
        arrays |= {"nodes": self.body.node_positions()}
        arrays |= {f"force {name}": force for name, force in forces.items()}
        arrays |= {f"moment {name}": moment for name, moment in moments.items()}
        arrays |= {f"state {name}": array for name, array in self.body.state().items()}
        counts = {"newton_iterations": float(reached.iterations), "cut_backs": float(reached.cutbacks)}
        counts["load_steps"] = float(reached.steps)
        counts["seconds_processor"] = self.body.comm.allreduce(self.solving_processor - self.reported)
        self.reported = self.solving_processor
        path = self.folder / f"frame_{reached.frame}.npz"
        measured, outside = self.body.validity.examine(reached.frame)
        scalars = self.body.scalars() | measured | counts | self.negative_modes(reached.frame)
        if reached.frame >= self.job.body.first:
            self.ranges.add(reached.frame, outside)
        if scalars.get("negative_modes", 0) > 0 and reached.frame >= self.job.body.first:
            self.unstable[reached.frame] = scalars["negative_modes"], scalars["material_modes"]
        if self.body.comm.rank == 0:
            np.savez(path, allow_pickle=False, **arrays)
        if self.restart is not None and reached.frame >= self.job.body.first:
            facts = {"size": reached.size, "exact": self.exact, "cost": self.cost(), "ranges": self.ranges.facts()}
            self.restart.write(reached.frame, facts | {"unstable": list(self.unstable.items())})
        self.report(frame=reached.frame, file=str(path), scalars=scalars, residuals=reached.last.residuals)

    def report(self, **event: Any) -> None:
        """Report a line to the parent process."""
        if self.body.comm.rank == 0:
            report(**event)

    def cost(self) -> dict[str, float]:
        """Seconds by phase on the first rank, counts, and processor time and memory over all ranks; with the cost of earlier
        processes up to the frame from which this one continued.
        """
        spent = self.body.spent
        memory = self.body.comm.allreduce(peak_memory())
        processor = self.body.comm.allreduce(time.process_time() - self.began)
        solving = self.body.comm.allreduce(self.solving_processor)
        own = {
            "seconds_set_up": self.set_up,
            "seconds_solve": self.solving,
            **{f"seconds_{name}": spent.seconds[name] for name in ("assembly", "contact", "factorisation", "krylov")},
            "seconds_stability": self.checking,
            "seconds_processor": processor,
            "seconds_processor_solve": solving,  # without compilation
            **{name: float(spent.counts[name]) for name in _COUNTED},
            **{name: float(count) for name, count in self.counts.items()},
        }
        own["newton_iterations"] += self.body.newton.thrown
        own = {name: value + self.earlier.get(name, 0.0) for name, value in own.items()}
        return own | {
            "unknowns": float(self.body.size),
            "peak_memory_mb": max(memory, self.earlier.get("peak_memory_mb", 0.0)),
            "ranks": float(self.body.comm.size),
            "threads": 1.0,
        }


def solve_field(problem: FieldProblem, folder: Path) -> None:
    """Solve for a scalar field, whose values are reported as one frame; there is one rank."""
    values, outcome = assembled_field.solve(problem)
    path = folder / "field.npz"
    np.savez(path, allow_pickle=False, values=values)
    report(frame=0, file=str(path))
    report(**outcome)


def solve_body(job: Job, folder: Path) -> None:
    """March a body through its frames."""
    Worker(job, folder).run()


_SOLVE: dict[Task, Callable[[Any, Path], None]] = {"solve_field": solve_field, "solve_body": solve_body}


def report(**event: Any) -> None:
    """Report a line to the process that started this one."""
    sys.stdout.write(f"{MARK}{json.dumps(event)}\n")
    sys.stdout.flush()


def main(argument: str) -> None:
    """Solve the job in a file; or, for ``-``, the jobs whose files standard input names, one after the other."""
    end_with_starter()
    compiling.prepare()
    gc.freeze()  # imported objects stay, and collections after each job skip them
    for line in sys.stdin if argument == "-" else [argument]:
        path = Path(line.strip())
        job = pickle.loads(path.read_bytes())
        _SOLVE[job.task](job, path.parent)
        gc.collect()


if __name__ == "__main__":
    main(sys.argv[1])
