"""Error bars of bodies, from a more accurate solution with quadratic elements or on cells of half the size."""

import logging

import numpy as np

from fem_reference.assessment import error_bars, second_check
from fem_reference.assessment.error_bars import BodyBars
from fem_reference.foundations.mesh import Ints
from fem_reference.problems.body import Body
from fem_reference.problems.finer import finer as on_finer_cells
from fem_reference.runs.store import Run
from fem_reference.solvers import fenicsx

log = logging.getLogger(__name__)

# On the same cells, quadratic elements have as many unknowns as linear ones on cells of half the size, and they do not lock.
_QUADRATIC = {"P1": "P2", "P1/P1": "P2/P1", "Q1": "Q2", "Q1/P0": "Q2/Q1"}


def body_bars(solved: Run) -> BodyBars | None:
    """The error bars of a run that :func:`solve_body` returned; None if the run did not converge."""
    if solved.outcome.status != "converged":
        log.info("no error bars: the body did not converge")
        return None
    settings, body = solved.settings, solved.body
    assert isinstance(settings, fenicsx.BodySettings)  # FEniCSx solved the body
    assert body is not None
    other, shared, changes, sharper = sharper_problem(body, settings)
    log.info("error bars: solving with %s", sharper)
    found = second_check.confirmed_body(other, fenicsx.solve_body(other, settings.model_copy(update=changes)))
    if found.outcome.status != "converged":
        log.info("error bars: with %s: %s, %s", sharper, found.outcome.status, found.outcome.message)
    states = () if found.outcome.status == "denied" else found.states
    bars = error_bars.body_bars(solved.states, states, shared, sharper)
    log.info("error bars: that of the displacement is %.2g %% at the last frame", 100 * bars.displacement[-1])
    return bars


def sharper_problem(
    body: Body, settings: fenicsx.BodySettings
) -> tuple[Body, Ints, dict[str, float | str | None], str]:
    """A more accurate problem: the new body, the indices of the points of ``body`` in the new body, the changed settings, and a
    description of the changes.
    """
    changes, said = dict[str, float | str | None](store_state=False), ""
    # Without friction and without effects that need the time between frame numbers, a state does not depend on the load steps.
    if body.rubs or any("interval" in effect.needs for effect in body.effects):
        largest = min(settings.largest_step or np.inf, float(np.diff(body.frames).max(initial=settings.first_step)))
        changes |= {"first_step": settings.first_step / 2, "largest_step": largest / 2}
        said = " and load steps of half the length"
    quadratic = _QUADRATIC.get(settings.element)
    if quadratic is not None:
        changes |= {"element": quadratic, "quadrature_degree": None}
        return body, np.arange(len(body.mesh.points)), changes, f"{quadratic} on the same cells{said}"
    return *on_finer_cells(body), changes, f"{settings.element} on cells of half the size{said}"
