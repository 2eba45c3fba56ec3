"""Unknowns and memory of a solution, and free memory and idle cores of the machine. This module does not need FEniCSx."""

import os
import time
from itertools import combinations
from pathlib import Path
from typing import Literal

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.problems.body import ELEMENTS, Cells, reference_nodes
from fem_reference.solvers.fenicsx.settings import BodySettings

# Below this number of unknowns a factorisation takes no longer than a few iterations of an iterative solver.
SMALL = 4000
# From this number of unknowns on, multigrid is faster than one factorisation per frame.
LARGE = 350_000
# Memory [MB]: of a process without a body; for each unknown, in addition to the factors; for each unknown with multigrid, in total;
# of the factors for 16 000 unknowns in double precision. Then the exponent with which the memory of the factors grows. Measured on
# gluteus_maximus with 16 000 to 560 000 unknowns. MUMPS allocates more than it uses.
_EMPTY, _EACH, _EACH_MULTIGRID, _FACTORS, _POWER = 250.0, 6.5e-3, 1e-2, 60.0, 1.38
# The maximum size [bytes] of the states of all frames that a run stores by default.
MOST_STATES = 2**26
# From this number of unknowns on, a second rank saves time, if a core is free for it.
_WORTH_RANKS = 20_000
_GLANCE = 0.2  # [s] over which the load of the cores is measured


def unknowns(cells: Cells, element: str) -> int:
    """The approximate number of unknowns on ``cells`` with an ``element``; a quadratic element has a node on every edge."""
    kind, degree, pressure = ELEMENTS[element]
    corners = cells.cells[:, : 4 if kind == "tetrahedron" else 8]
    count = len(np.unique(corners))
    pressures = {None: 0, 0: len(corners), 1: count}[pressure]
    if degree == 2:
        if kind == "hexahedron":
            count *= 8  # a large grid has 3 edges, 3 faces and 1 cell per vertex
        else:
            pairs = np.concatenate([np.sort(corners[:, pair], axis=1) for pair in combinations(range(4), 2)])
            count += len(np.unique(pairs[:, 0].astype(np.int64) * (corners.max() + 1) + pairs[:, 1]))
    return 3 * count + pressures


def state(cells: Cells, element: str, *, steps: bool) -> int:
    """The size [bytes] of the state of ``cells`` at a frame; with ``steps`` it includes the start of the last load step."""
    kind, degree, pressure = ELEMENTS[element]
    nodes, corners = (len(reference_nodes(kind, order)) for order in (degree, 1))
    pressures = {None: 0, 0: 1, 1: corners}[pressure]
    return 8 * len(cells.cells) * (3 * nodes * (1 + steps) + pressures)


def memory(count: int, solver: str, precision: str) -> float:
    """The approximate memory [MB] of a solution of ``count`` unknowns."""
    if solver == "multigrid":
        return _EMPTY + _EACH_MULTIGRID * count
    factors = _FACTORS * float((count / 16_000) ** _POWER)
    return _EMPTY + _EACH * count + (factors if precision == "double" else factors / 2)


def available() -> float:
    """The free memory [MB] that the system reports; infinite if it does not report any."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="utf-8").splitlines()
        return next(float(line.split()[1]) / 1024 for line in lines if line.startswith("MemAvailable"))
    except (OSError, StopIteration, ValueError):
        return float("inf")


def planned[S: BodySettings](settings: S, cells: Cells, free: float) -> S:
    """The settings with linear solver and precision, as requested or as size and ``free`` memory [MB] allow. Raises InputError if
    no solver fits into the memory.
    """
    count = unknowns(cells, settings.element)
    for kind in [settings.linear_solver] if settings.linear_solver else _fitting(settings.element, count):
        precision = settings.precision or ("double" if kind == "direct" else "single")
        needed = memory(count, kind, precision)
        if needed <= free:
            return settings.model_copy(update={"linear_solver": kind, "precision": precision})
    got = f"{needed:.0f} MB for {count} unknowns ({kind})"
    raise InputError("memory", got, f"at most the {free:.0f} MB of free memory; larger cells need less")


def _fitting(element: str, count: int) -> list[Literal["direct", "lagged", "multigrid"]]:
    """The linear solvers for an ``element`` and this number of unknowns, the preferred one first."""
    _, degree, pressure = ELEMENTS[element]
    if count < SMALL or degree == 1 or pressure is None:
        return ["direct" if count < SMALL else "lagged"]
    return ["lagged", "multigrid"] if count < LARGE else ["multigrid"]


def idle_cores() -> int:
    """The number of idle cores among those that this process may use; all of them if the system does not report their load."""
    mine = os.sched_getaffinity(0)
    try:
        before, begin = _idle(mine), time.perf_counter()
        time.sleep(_GLANCE)
        ticks = (time.perf_counter() - begin) * os.sysconf("SC_CLK_TCK")
        return round((_idle(mine) - before) / ticks)
    except (OSError, KeyError, IndexError, ValueError):
        return len(mine)


def _idle(cores: set[int]) -> float:
    """The clock ticks for which ``cores`` have been idle since the system started."""
    fields = {line.split()[0]: line.split() for line in Path("/proc/stat").read_text(encoding="utf-8").splitlines()}
    return sum(float(fields[f"cpu{core}"][4]) for core in cores)


def ranks(settings: BodySettings, count: int) -> int:
    """The number of ranks for a solution of ``count`` unknowns: two if that is faster and two cores are idle, otherwise one."""
    worth = settings.linear_solver != "multigrid" and count >= _WORTH_RANKS
    return 2 if worth and idle_cores() >= 2 else 1
