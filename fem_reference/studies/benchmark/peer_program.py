"""A program of its own: one peer solves the problem of ``peer_problem`` and writes what that took, and where it ended."""

import json
import os
import resource
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.studies.benchmark import peer_problem, peers

# Solved first, which compiles and loads what the work needs: rings, slices and load steps.
WARM_UP = (1, 4, 1)


def processor() -> float:
    """Processor time [s] of this process, of those that it started and that have ended, and of those that run."""
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(used.ru_utime + used.ru_stime for used in both) + _of_running()


def _of_running() -> float:
    """Processor time [s] of our subprocesses that run, where the system says it."""
    ticks = 0
    with suppress(OSError):
        for children in Path("/proc/self/task").glob("*/children"):
            for process in children.read_text(encoding="ascii").split():
                fields = Path("/proc", process, "stat").read_text(encoding="utf-8").rpartition(")")[2].split()
                ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def main(order: Path) -> None:
    """Carry out the JSON in the file ``order``: what ``peer`` needs for the ``body`` (element, rings, slices, load steps), as
    ``facts``, JSON, and its last ``positions``, npz.
    """
    wanted = json.loads(order.read_text(encoding="utf-8"))
    with peers.find(wanted["peer"]).opened() as solve:
        solve(peer_problem.muscle(wanted["body"][0], *WARM_UP))
        muscle = peer_problem.muscle(*wanted["body"])
        begin, before = time.perf_counter(), processor()
        solved = solve(muscle)
        wall, spent = time.perf_counter() - begin, processor() - before
    facts: dict[str, Any] = {
        "converged": solved.converged,
        "message": solved.message,
        "iterations": solved.iterations,
        "unknowns": solved.unknowns,
        "wall": wall,
        "processor": spent,
    }
    np.savez(wanted["positions"], allow_pickle=False, positions=solved.positions)
    Path(wanted["facts"]).write_text(json.dumps(facts), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
