"""Growth of costs with size, on generated bodies: of the reference by phase, and of the fast solvers of Table 5.1.

For the reference, the wall time of one load step is measured over the number of unknowns; for candidates, with the settings of the
table, the processor time per iteration over the number of triangles or tetrahedra. Memory is the increase during a run.
"""

import ctypes
import gc
from contextlib import suppress
from dataclasses import replace
from math import nan

from benchmarks import over
from benchmarks.bodies import ellipsoid, fusiform, spindle
from benchmarks.candidates import SOLVERS, per_iteration, spent
from benchmarks.power_law import PowerLaw, fit
from benchmarks.reference import solve_fusiform
from fem_reference import solvers
from fem_reference.foundations.subprocesses import forget_peak_memory, peak_memory
from fem_reference.problems import setup as problem_setup
from fem_reference.solvers import fenicsx

# Subdivisions of the icosahedron of an ellipsoid; rings and slices of spindles of tetrahedra, and of bodies for the reference.
SUBDIVISIONS = (2, 3, 4, 5, 6)
SPINDLES = ((1, 6), (2, 9), (2, 18), (3, 24), (4, 36))
BODIES = ((1, 4), (1, 10), (2, 16), (3, 24), (4, 36))
ELEMENT = "P2/P1"
# Iterations of a short and of a longer run, and the number of repeats of each.
COUNTS, REPEATS = (1, 5), 2
# The cost of rods grows with the number of fibres.
GROWING = {name: one for name, one in SOLVERS.items() if one.solver != "viper"}
# The size to which a cost is extrapolated, and the numbers shown of a fit.
LARGE = 1e7
NUMBERS = ("exponent", "standard error", "at 1e7", "at 1e7, at least", "at 1e7, at most")
OF_REFERENCE = ("seconds_wall", "seconds_assembly", "seconds_factorisation", "seconds_krylov", "memory")
OF_CANDIDATES = ("iteration", "memory")

# Costs by name at one size, and this size.
Point = dict[str, float]


def of_reference(sizes: tuple[tuple[int, int], ...] = BODIES) -> list[Point]:
    """The costs of the reference in one load step [s, MB]."""
    with fenicsx.session() as own:
        # The first body is small; with it, code is compiled and loaded.
        bodies = [replace(fusiform(ELEMENT, *size), frames=(0.0, 1.0)) for size in ((1, 2), *sizes)]
        begin, *found = [solve_fusiform(own, body, ELEMENT) for body in bodies]
    return [one | {"size": one["unknowns"], "memory": one["peak_memory_mb"] - begin["peak_memory_mb"]} for one in found]


def of_candidate(name: str, most: int | None = None) -> list[Point]:
    """The time of a candidate per iteration [s], and its memory [MB], at the first ``most`` sizes, by default all."""
    chosen = GROWING[name]
    settings, tets = solvers.settings(chosen, name), chosen.solver == "mass_spring"
    made: list[problem_setup.Setup] = (
        [spindle(*size) for size in SPINDLES] if tets else [ellipsoid(k) for k in SUBDIVISIONS]
    )
    points = []
    for setup in made[:most]:
        size = len(setup.rest.mesh.tets if setup.rest.mesh else setup.surface.triangles)
        spent(chosen.solver, settings, setup, 1)  # compiled code is loaded
        _give_back()
        forget_peak_memory()
        before = peak_memory()
        spent(chosen.solver, settings, setup, 1)
        memory = peak_memory() - before
        iteration = per_iteration(chosen.solver, settings, setup, COUNTS, REPEATS)
        points.append({"size": size, "iteration": iteration, "memory": memory})
    return points


def _give_back() -> None:
    """Return free memory to the system, as its reuse would not be measured; only the C library of Linux can do this."""
    gc.collect()
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)


def law(points: list[Point], cost: str) -> PowerLaw | None:
    """The growth of a cost, None if it is above zero at fewer than three sizes."""
    return fit([one["size"] for one in points], [one[cost] for one in points])


def shown(found: PowerLaw | None, number: str) -> float:
    """One of the ``NUMBERS`` of a fit."""
    if found is None:
        return nan
    return dict(zip(NUMBERS, (found.exponent, found.uncertainty, *found.at(LARGE)), strict=True))[number]


class Reference:
    """The growth of the costs of the reference, and the costs to which it is fitted."""

    timeout = 7200

    def setup_cache(self) -> list[Point]:
        """The costs at all sizes."""
        return of_reference()

    @over("s, MB or 1", cost=OF_REFERENCE, number=NUMBERS)
    def track_growth(self, points: list[Point], cost: str, number: str) -> float:
        """A number of the fit of a cost."""
        return shown(law(points, cost), number)

    @over("s, MB or 1", body=range(len(BODIES)), cost=("size", *OF_REFERENCE))
    def track_cost(self, points: list[Point], body: int, cost: str) -> float:
        """A cost of a body."""
        return points[body][cost]


class Candidates:
    """The growth of the costs of the fast solvers, and the costs to which it is fitted."""

    timeout = 7200

    def setup_cache(self) -> dict[str, list[Point]]:
        """The costs of each at all sizes."""
        return {name: of_candidate(name) for name in GROWING}

    @over("s, MB or 1", solver=GROWING, cost=OF_CANDIDATES, number=NUMBERS)
    def track_growth(self, points: dict[str, list[Point]], solver: str, cost: str, number: str) -> float:
        """A number of the fit of a cost."""
        return shown(law(points[solver], cost), number)

    @over("s, MB or 1", solver=GROWING, body=range(len(SUBDIVISIONS)), cost=("size", *OF_CANDIDATES))
    def track_cost(self, points: dict[str, list[Point]], solver: str, body: int, cost: str) -> float:
        """A cost of a body."""
        return points[solver][body][cost]
