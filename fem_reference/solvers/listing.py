"""The report's Octave listings (4.1 on an interval, 4.5 on triangles) as they compute, whatever equation the scene states."""

import time

import numpy as np
from pydantic import Field

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record, join
from fem_reference.problems.scalar import FieldProblem, at
from fem_reference.runs.store import Frame, Outcome, Sink
from fem_reference.solvers import listing_kernels
from fem_reference.solvers.common.protocol import FieldSolver


class ListingSettings(Record):
    """``peclet``: the argument of listing 4.1, by default 1 as in its head; listing 4.5 has none."""

    peclet: float | None = Field(default=None, gt=0)


def solve(problem: FieldProblem, settings: ListingSettings, sink: Sink) -> Outcome:
    """The listing for the problem's domain, from its mesh and what is fixed; its effects and slopes are the listing's own.

    What listing 4.5 draws is minus the norm of its vector unknown; that is the field here, and the vector its components.
    """
    begin = time.perf_counter()
    mesh = problem.mesh
    check(settings, problem, "listing")
    if mesh.cells.shape[1] == 2:
        values, components = listing_kernels.fem1d(mesh.points[:, 0], settings.peclet or 1.0), None
    else:
        fixed = np.flatnonzero(~np.isnan(problem.fixed[: len(mesh.points)]))
        bounds = np.array([fixed, problem.fixed[fixed]])
        norms, components = listing_kernels.fem2d(mesh.cells, mesh.points, bounds)
        values = 0.0 - norms
    if problem.order == 2:  # the listings are linear between vertices
        values = np.concatenate([values, values[mesh.edges].mean(axis=1)])
    cost = {
        "seconds_solve": time.perf_counter() - begin,
        "unknowns": float(len(mesh.points) if components is None else components.size),
    }
    sink(Frame.of_field(problem, values, "as listed", components))
    return Outcome("converged", "as listed", cost)


def check(settings: ListingSettings, problem: FieldProblem, place: str) -> None:
    """InputError at ``place`` where the listing for the problem's domain has not what the case or the settings ask for."""
    if problem.mesh.cells.shape[1] == 2:
        _check_ends(problem, place)
    elif settings.peclet is not None:
        raise InputError(join(place, "peclet"), settings.peclet, "no peclet: listing 4.5 has none")
    elif problem.fluxes:
        raise InputError(join(place, "boundary"), "a slope", "values only: listing 4.5 has no slopes")


def _check_ends(problem: FieldProblem, place: str) -> None:
    """InputError where the scene wants other conditions than listing 4.1 has: 0 at the first node, slope -1 at the last."""
    points, fixed = problem.mesh.points, problem.fixed[: len(problem.mesh.points)]
    slopes = [(point, at(flux.slope, points[[point]])[0]) for flux in problem.fluxes for point in flux.facets[:, 0]]
    if not (fixed[0] == 0 and np.isnan(fixed[1:]).all() and slopes == [(len(points) - 1, -1.0)]):
        want = "value 0 on the left and slope -1 on the right, as listing 4.1 has"
        raise InputError(join(place, "boundary"), "other conditions", want)


SOLVES = (FieldSolver(settings=ListingSettings, solve=solve, check_problem=check, example={}),)
