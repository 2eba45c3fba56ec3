"""The process that solves: reads a pickled job, marches through its frames, and reports each as a line of JSON."""

import json
import pickle
import resource
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.mesh import Floats, Ints
from fem_reference.problem import Problem
from fem_reference.solvers.fenicsx import Settings
from fem_reference.solvers.fenicsx.dolfinx_door import PETSc
from fem_reference.solvers.fenicsx.processes import MARK

from fem_reference.solvers.fenicsx.body import Body  # isort: skip - after the door
from fem_reference.solvers.fenicsx.stepping import Attempt, Reached, march  # isort: skip

Samples = dict[str, tuple[Ints, Floats]]


class Worker:
    """One job on all ranks; the first rank reports."""

    def __init__(self, job: Path) -> None:
        self.begin = time.perf_counter()
        problem, settings, samples = pickle.loads(job.read_bytes())
        self.problem: Problem = problem
        self.settings: Settings = settings
        self.samples: Samples = samples
        self.folder = job.parent
        PETSc.Log.begin()
        self.body = Body(problem, settings.residual, settings.newton_iterations)
        self.rest_volume = self.body.integral(self.body.volume_form)
        self.set_up = time.perf_counter() - self.begin
        self.solving = 0.0
        self.counts = {"newton_iterations": 0, "load_steps": 0, "cut_backs": 0}

    def run(self) -> None:
        """March through the frames and report how it ended."""
        frames, settings = self.problem.frames, self.settings
        self.report_frame(Reached(frames[0], 0, 0, 0))
        for reached in march(self.attempt, frames, settings.first_step, settings.smallest_step):
            for name, count in (
                ("newton_iterations", reached.iterations),
                ("load_steps", reached.steps),
                ("cut_backs", reached.cutbacks),
            ):
                self.counts[name] += count
            if reached.failed is not None:
                self.report(status=reached.failed.failure, message=self.sentence(reached), cost=self.cost())
                return
            self.report_frame(reached)
        self.report(status="converged", message=f"all {len(frames)} frames reached", cost=self.cost())

    def attempt(self, frame: float) -> Attempt:
        """Solve at ``frame`` from the last state; on failure go back to it."""
        before, begin = self.body.state(), time.perf_counter()
        converged, iterations = self.body.solve(frame)
        self.solving += time.perf_counter() - begin
        smallest = self.body.smallest_determinant("quadrature points")
        if converged and smallest.value > 0:
            return Attempt(None, iterations)
        self.body.restore(before)
        if converged:
            return Attempt("inverted", iterations, f"det F fell to {smallest}")
        return Attempt("diverged", iterations, f"Newton's method did not converge in {iterations} iterations")

    def sentence(self, reached: Reached) -> str:
        """Why a frame could not be reached, where, and what to try."""
        assert reached.failed is not None
        smallest = self.body.smallest_determinant("vertices")
        return (
            f"{reached.failed.sentence} beyond frame {reached.at:.2f} with steps down to {self.settings.smallest_step}; "
            f"in the last good state det F is smallest, {smallest}; try smaller tetrahedra (muscle.tet_size) or a smaller motion"
        )

    def report_frame(self, reached: Reached) -> None:
        """Write the frame's positions beside the job and tell of it."""
        positions = {name: self.body.positions(*sample) for name, sample in self.samples.items()}
        scalars = {
            "min_det_F_quadrature": self.body.smallest_determinant("quadrature points").value,
            "min_det_F_vertices": self.body.smallest_determinant("vertices").value,
            "volume_ratio": self.body.integral(self.body.volume_form) / self.rest_volume,
            "energy": self.body.integral(self.body.energy_form),
            "newton_iterations": float(reached.iterations),
            "cut_backs": float(reached.cutbacks),
        }
        path = self.folder / f"frame_{reached.frame}.npz"
        if self.body.comm.rank == 0:
            np.savez(path, allow_pickle=False, **positions)
        self.report(frame=reached.frame, file=str(path), scalars=scalars)

    def report(self, **event: Any) -> None:
        """A line for the parent process."""
        if self.body.comm.rank == 0:
            sys.stdout.write(f"{MARK}{json.dumps(event)}\n")
            sys.stdout.flush()

    def cost(self) -> dict[str, float]:
        """Seconds by phase as the first rank sees them, counts, and memory over all ranks."""
        spent = {
            name: PETSc.Log.Event(name).getPerfInfo() for name in ("SNESFunctionEval", "SNESJacobianEval", "MatSolve")
        }
        factor = [PETSc.Log.Event(name).getPerfInfo() for name in ("MatLUFactorSym", "MatLUFactorNum")]
        memory = self.body.comm.allreduce(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
        return {
            "seconds_mesh": self.problem.seconds,
            "seconds_set_up": self.set_up,
            "seconds_solve": self.solving,
            "seconds_assembly": spent["SNESFunctionEval"]["time"] + spent["SNESJacobianEval"]["time"],
            "seconds_factorisation": sum(event["time"] for event in factor),
            "seconds_back_substitution": spent["MatSolve"]["time"],
            "factorisations": float(factor[1]["count"]),
            **{name: float(count) for name, count in self.counts.items()},
            "unknowns": float(self.body.size),
            "peak_memory_mb": memory / 1024,
            "ranks": float(self.body.comm.size),
            "threads": 1.0,
        }


if __name__ == "__main__":
    Worker(Path(sys.argv[1])).run()
