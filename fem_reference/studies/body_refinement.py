"""The sharper solution that the error bars of a body are made of."""

import logging

import numpy as np

from fem_reference.assessment.body_bars import BodyBars, body_bars
from fem_reference.foundations.mesh import Ints
from fem_reference.problems.body import Body
from fem_reference.problems.finer import finer
from fem_reference.runs.store import Run
from fem_reference.solvers import fenicsx

log = logging.getLogger(__name__)

# What is quadratic has as many unknowns on the same cells as what is linear on cells of half the size, and does not lock.
_QUADRATIC = {"P1": "P2", "P1/P1": "P2/P1", "Q1": "Q2", "Q1/P0": "Q2/Q1"}


def obtain(solved: Run) -> BodyBars | None:
    """The error bars of a run by :func:`solve_body`; None where that did not converge."""
    if solved.outcome.status != "converged":
        log.info("error bars: none, of a body that did not converge")
        return None
    settings, body = solved.settings, solved.body
    assert isinstance(settings, fenicsx.BodySettings)  # what solved the body
    assert body is not None
    other, shared, changes, sharper = sharper_problem(body, settings)
    log.info("error bars: solving with %s", sharper)
    found = fenicsx.solve_body(other, settings.model_copy(update=changes))
    if found.outcome.status != "converged":
        log.info("error bars: with %s: %s, %s", sharper, found.outcome.status, found.outcome.message)
    bars = body_bars(solved.states, found.states, shared, sharper)
    log.info("error bars: displacement is known to %.2g %% of itself at the last frame", 100 * bars.displacement[-1])
    return bars


def sharper_problem(
    body: Body, settings: fenicsx.BodySettings
) -> tuple[Body, Ints, dict[str, float | str | None], str]:
    """A sharper problem: the body, indices of the points of ``body`` among its own, changes of the settings, and these in words."""
    changes: dict[str, float | str | None] = {"store_state": False}
    said = ""
    if any("interval" in effect.needs for effect in body.effects):  # else a state does not depend on load steps
        largest = min(settings.largest_step or np.inf, float(np.diff(body.frames).max(initial=settings.first_step)))
        changes |= {"first_step": settings.first_step / 2, "largest_step": largest / 2}
        said = " and load steps of half the length"
    quadratic = _QUADRATIC.get(settings.element)
    if quadratic is not None:
        changes |= {"element": quadratic, "quadrature_degree": None}
        return body, np.arange(len(body.mesh.points)), changes, f"{quadratic} on the same cells{said}"
    other, shared = finer(body)
    return other, shared, changes, f"{settings.element} on cells of half the size{said}"
