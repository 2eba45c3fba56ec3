"""The balance of the forces on a body, checked with recorded forces and dead loads, independently of the solver's residuals."""

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np

from fem_reference.assessment.run_checks import BALANCE, ROUNDING, RunCheck
from fem_reference.effects import region_of
from fem_reference.foundations.mesh import Floats, TetMesh, upright
from fem_reference.geometry.quadratic import Displaced
from fem_reference.problems.body import Body
from fem_reference.runs.store import Frame, Run


def balance(body: Body, solved: Run) -> Iterator[RunCheck]:
    """Check that the recorded forces on a ``body`` and its dead loads sum to zero. Without loads, the moments about the origin are
    checked too.

    There is no check if some forces are unknown: for a body that starts displaced or under tension; with a user's own effects,
    follower loads, inertia or drag; and with loads on cells other than straight tetrahedra. There is no check either if two regions
    share nodes and a prescribed component, because each of the two regions then records the force on these nodes.
    """
    residual, unknowns = getattr(solved.settings, "residual", math.nan), solved.outcome.cost.get("unknowns", math.nan)
    allowed, outer = BALANCE * residual * math.sqrt(unknowns), any(one.outer for one in body.effects)
    for state in () if body.begun else solved.states[1:]:  # the first state is prescribed and need not be in balance
        load = _load(body, state.number)
        if load is None or not math.isfinite(allowed) or not _counted_once(body, state):
            return
        rounding = ROUNDING * (float(np.abs(list(state.forces.values())).sum()) + float(np.abs(load).sum()))
        most, off = allowed + rounding, float(np.linalg.norm(_sum(state.forces) + load))
        yield RunCheck("residual force", off, most, "N", state.number)
        if not outer:
            arm, off = float(np.abs(state.points).max()), float(np.linalg.norm(_sum(state.moments)))
            yield RunCheck("residual moment", off, most * arm, "N mm", state.number)


def _sum(vectors: dict[str, Floats]) -> Floats:
    return np.sum([np.zeros(3), *vectors.values()], axis=0)


def _counted_once(body: Body, state: Frame) -> bool:
    """True if a ``state`` records every force on a ``body`` exactly once."""
    others = {bone.name for bone in body.bones} | {name for law in body.touching for name in law.forces}
    names = {entry.name for entry in body.prescribed}
    if names & others or not names <= set(state.forces) or set(state.forces) != set(state.moments):
        return False
    regions = [(set(one.components), body.mesh.facets[one.on]) for one in body.prescribed if isinstance(one.on, str)]
    pairs = combinations(regions, 2)
    return not any(along & other and len(np.intersect1d(on, near)) for (along, on), (other, near) in pairs)


def _load(body: Body, frame: float) -> Floats | None:
    """The sum (3,) [N] of the external loads at a ``frame``; None if the shape at rest is not enough to compute it."""
    if not all(type(one).__module__.startswith("fem_reference.effects.") for one in body.effects):
        return None
    acting, mesh = [one for one in body.effects if one.outer], body.mesh
    if not acting:
        return np.zeros(3)
    if mesh.kind != "tetrahedron" or mesh.degree > 1 or any(map(region_of, acting)):
        return None
    cells = upright(mesh.points, mesh.cells)
    rest = Displaced(TetMesh(mesh.points, cells, mesh.facets))  # the present positions are not known
    found = [(one.amount(frame), one.resultant(rest)) for one in acting]
    forces = [amount * load.force for amount, load in found if load is not None]
    return None if len(forces) < len(acting) else np.sum(forces, axis=0)
