"""The worker process: it reads pickled jobs, marches each body through its frames, and reports every frame."""

import gc
import pickle
import sys
import time
from functools import partial
from itertools import count
from pathlib import Path

from fem_reference.foundations.subprocesses import end_with_starter, forget_peak_memory, peak_memory
from fem_reference.problems.scalar import FieldProblem
from fem_reference.runs.contents import Status
from fem_reference.runs.store import Frame, Outcome, Sink
from fem_reference.solvers.fenicsx import dolfinx_door  # noqa: F401 - must be imported before the packages below
from fem_reference.solvers.fenicsx.jobs import Job
from fem_reference.solvers.fenicsx.processes import MARK

from mpi4py import MPI  # isort: skip - after dolfinx_door
from fem_reference.solvers.fenicsx import compiling, assembled_field  # isort: skip
from fem_reference.solvers.fenicsx.body import AssembledBody  # isort: skip
from fem_reference.solvers.fenicsx.modes import ahead, leave  # isort: skip
from fem_reference.solvers.fenicsx.restart import Restart  # isort: skip
from fem_reference.solvers.fenicsx.system import reactions  # isort: skip
from fem_reference.solvers.fenicsx.validity import Ranges  # isort: skip
from fem_reference.solvers.common.load_steps import Attempt, Step, StepSizes, march  # isort: skip


_COUNTED = ("factorisations", "factorisation_flops", "krylov_iterations", "halved_steps")
_numbers = count()  # of the reports


class Worker:
    """One job on all ranks; ``report`` receives the frames."""

    def __init__(self, job: Job, report: Sink) -> None:
        begin = time.perf_counter()
        forget_peak_memory()
        self.began = time.process_time()
        self.job, self.report, self.settings = job, report, job.settings
        self.body = AssembledBody(job.body, job.settings)
        self.body.judged = bool(job.samples)
        if job.body.start is not None:
            self.body.start(job.body.start)
        self.set_up = time.perf_counter() - begin
        self.solving = self.solving_processor = self.checking = 0.0
        self.reported = 0.0  # ``solving_processor`` up to the last reported frame
        self.counts = {"newton_iterations": 0, "load_steps": 0, "cut_backs": 0}
        self.unstable: dict[float, tuple[float, float]] = {}  # by frame: negative modes, and those of the material
        self.left: dict[float, float] = {}  # the perturbation [mm] in each frame that has one
        self.ranges = Ranges()
        self.exact = False  # True once linear systems are solved exactly, after a failure of Newton's method
        self.collapse = ""  # the message of the last collapse of the body; empty if an attempt has converged since
        self.earlier: dict[str, float] = {}  # the cost of earlier processes of this run
        self.restart = Restart(self.body, job.kept) if job.kept else None

    def begin(self) -> tuple[tuple[float, ...], StepSizes]:
        """The frames to march through and the load steps, from rest or from the frame at which an earlier process was cut off."""
        frames, settings = self.job.body.frames, self.settings
        first, good = settings.first_step, self.restart.good() if self.restart else ()
        if not self.restart or not good:
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

    def run(self) -> Outcome:
        """March through the frames and return the outcome of the run."""
        frames, steps = self.begin()
        for reached in march(self.attempt, frames, steps, self.body.recall, self.solve_exactly):
            self.counts["newton_iterations"] += reached.iterations
            self.counts["load_steps"] += reached.steps
            self.counts["cut_backs"] += reached.cutbacks
            if not reached.last.converged:
                return Outcome(*self.failure(reached), self.cost())
            if self.settings.follow == "stable":
                perturbation = leave(self.body, reached.frame, self.settings.perturbation)
                self.left |= {} if perturbation is None else {reached.frame: perturbation}
            self.report_frame(reached)
        wanted = sum(frame >= self.job.body.first for frame in self.job.body.frames)
        message = f"all {wanted} frames reached{self.departures()}{self.instability()}{self.ranges}"
        message += self.restart.note if self.restart else ""
        return Outcome("converged", message, self.cost())

    def attempt(self, frame: float) -> Attempt:
        """Solve at ``frame`` from the last state, which is restored on failure."""
        begin, processor = time.perf_counter(), time.process_time()
        result = self.body.attempt(frame)
        self.solving += time.perf_counter() - begin
        self.solving_processor += time.process_time() - processor
        if result.status in ("converged", "collapsed"):
            self.collapse = result.detail
        return result

    def solve_exactly(self) -> bool:
        """Solve linear systems exactly from now on, as inexact solutions move a nearly free body too far. True if changed."""
        other = self.body.linear.solve_exactly()
        self.exact |= other
        return other

    def departures(self) -> str:
        """A note on unstable equilibria from which a perturbation moved the run away; empty if there are none."""
        if not self.left:
            return ""
        return (
            f"; in {len(self.left)} of them the run moved off an unstable equilibrium along its lowest mode, "
            f"first at frame {min(self.left):g}, by a perturbation of up to {max(self.left.values()):.3g} mm"
        )

    def negative_modes(self, frame: float) -> dict[str, float]:
        """The number of directions in which the energy decreases from a reached state, and of those due to the material, if known.
        The time spent on them does not count as solving.
        """
        begin = time.perf_counter()
        modes = self.body.examine(frame)
        own = self.body.modes_of_material() if modes is not None and modes > 0 else modes
        self.checking += time.perf_counter() - begin
        return {} if modes is None or own is None else {"negative_modes": modes, "material_modes": own}

    def instability(self) -> str:
        """A note on unstable states; empty if there are none."""
        if not self.unstable:
            return ""
        most, own = (max(modes) for modes in zip(*self.unstable.values(), strict=True))
        return (
            f"; in {len(self.unstable)} of them the equilibrium is unstable, first at frame {min(self.unstable):g} "
            f"(negative modes: up to {most:.0f}, at least {own:.0f} of them due to the material)"
        )

    def failure(self, reached: Step) -> tuple[Status, str]:
        """The status of a run that did not reach a frame, and a sentence with the reason, the position and a remedy."""
        body, contact = self.body, self.body.contact
        other = "a larger bulk modulus" if self.collapse else "smaller cells"
        self.ranges.add(reached.at, body.validity.examine(reached.at)[1])
        sentence = (
            f"{self.collapse or reached.last.detail} beyond frame {reached.at:.2f} "
            f"with load steps down to {self.settings.smallest_step}; "
            f"in the last good state the smallest det F is {body.determinants.smallest()}"
            f"{f', and the deepest contact is {contact.deepest()}' if contact else ''}"
            f"{self.instability().replace('of them', 'of the frames reached')}{self.ranges}; "
            f"try a smaller motion or {other}"
        )
        if self.collapse:
            return "collapsed", sentence
        limit = ahead(body, self.settings.smallest_step)
        return (reached.last.status, sentence) if limit is None else ("limit point", f"{limit}; {sentence}")

    def report_frame(self, reached: Step) -> None:
        """Report the state of a reached frame, and store it if the run may have to continue from it."""
        body, frame = self.body, reached.frame
        samples = {name: body.positions(*sample) for name, sample in self.job.samples.items()}
        forces, moments = reactions(body.system, body.contact, divided=bool(samples))
        measured, outside = body.validity.examine(frame)
        scalars = body.scalars() | measured
        scalars |= {"newton_iterations": reached.iterations, "cut_backs": reached.cutbacks, "load_steps": reached.steps}
        scalars["seconds_processor"] = body.comm.allreduce(self.solving_processor - self.reported)
        self.reported = self.solving_processor
        scalars |= self.negative_modes(frame)
        if frame >= self.job.body.first:
            self.ranges.add(frame, outside)
            if scalars.get("negative_modes", 0) > 0:
                self.unstable[frame] = scalars["negative_modes"], scalars["material_modes"]
            if self.restart is not None:
                facts = {"size": reached.size, "exact": self.exact, "cost": self.cost(), "ranges": self.ranges.facts()}
                self.restart.write(frame, facts | {"unstable": list(self.unstable.items())})
        found = Frame(
            frame,
            samples.get("surface"),
            samples.get("fibres"),
            points=body.nodal.positions(),
            scalars={name: float(value) for name, value in scalars.items()},
            state=body.nodal.state() if self.settings.store_state or samples else None,
            forces=forces,
            moments=moments,
            residuals=reached.last.residuals,
        )
        self.report(found)

    def cost(self) -> dict[str, float]:
        """Seconds by phase on the first rank, counts, and processor time and memory over all ranks; they include the cost of
        earlier processes up to the frame from which this one continued.
        """
        body, spent = self.body, self.body.spent
        memory = body.comm.allreduce(peak_memory())
        own = {
            "seconds_set_up": self.set_up,
            "seconds_solve": self.solving,
            **{f"seconds_{name}": spent.seconds[name] for name in ("assembly", "contact", "factorisation", "krylov")},
            "seconds_stability": self.checking,
            "seconds_processor": body.comm.allreduce(time.process_time() - self.began),
            "seconds_processor_solve": body.comm.allreduce(self.solving_processor),  # without compilation
            **{name: float(spent.counts[name]) for name in _COUNTED},
            **{name: float(count) for name, count in self.counts.items()},
        }
        own["newton_iterations"] += body.newton.thrown
        own = {name: value + self.earlier.get(name, 0.0) for name, value in own.items()}
        return own | {
            "unknowns": float(body.size),
            "peak_memory_mb": max(memory, self.earlier.get("peak_memory_mb", 0.0)),
            "ranks": float(body.comm.size),
            "threads": 1.0,
        }


def solve(job: Job | FieldProblem, report: Sink) -> Outcome:
    """March a body through its frames on all ranks, or solve for a scalar field on one; ``report`` receives the frames."""
    if isinstance(job, Job):
        try:
            worker = Worker(job, report)
        except ArithmeticError as error:
            return Outcome("diverged", f"at rest: {error}")
        return worker.run()
    values, outcome = assembled_field.solve(job)
    report(Frame.of_field(job, values, job.form))
    return outcome


def report(folder: Path, found: Frame | Outcome) -> None:
    """Write ``found`` into a file in the ``folder`` and report the file to the parent process, on the first rank only."""
    if MPI.COMM_WORLD.rank == 0:
        file = folder / f"report_{next(_numbers)}.pickle"
        file.write_bytes(pickle.dumps(found))
        sys.stdout.write(f"{MARK}{file}\n")
        sys.stdout.flush()


def main() -> None:
    """Solve jobs one after the other. Each line of standard input names the file of a job."""
    end_with_starter()
    compiling.prepare()
    gc.freeze()  # collections after each job then skip imported objects, which stay
    comm = MPI.COMM_WORLD
    while line := comm.bcast(sys.stdin.readline() if comm.rank == 0 else ""):
        path = Path(line.rstrip("\n"))
        outcome = solve(pickle.loads(path.read_bytes()), partial(report, path.parent))
        report(path.parent, outcome)
        gc.collect()


if __name__ == "__main__":
    main()
