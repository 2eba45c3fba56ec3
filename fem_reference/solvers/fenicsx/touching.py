"""Contact between parts of the surface of a body: forces on the nodes of both sides, and their tangent.

Quadrature points on either side, each weighted with half of its area, are paired with points on the deformed facets of the other
side, so the two sides are treated alike. Both forces act along one line, so forces and moments balance to within rounding.
"""

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.sparse import csr_array

from fem_reference.foundations.mesh import Floats, place_of
from fem_reference.problems.body import Body
from fem_reference.problems.overlaps import beyond_rim, overlap, unseen
from fem_reference.solvers.common.state_checks import Trouble
from fem_reference.solvers.fenicsx.facets import facets_of
from fem_reference.solvers.fenicsx.forms import Form
from fem_reference.solvers.fenicsx.meshes import Displacement, local_facets
from fem_reference.solvers.fenicsx.rays import Hits, RayPass
from fem_reference.solvers.fenicsx.rubbing import Rubbed, Rubbing
from fem_reference.solvers.fenicsx.spent import Spent
from fem_reference.solvers.fenicsx.touching_passes import Met, Pass, PressedPoints

# With friction no point may slide farther than this beyond the facet on which it begins a load step, in reference coordinates.
_FAR = 1.0
# The unknowns (n,) of a search, the contact and the friction in each pass, and the fractions of overlaps at rest that are
# subtracted.
State = tuple[Floats, list[tuple[Met, PressedPoints]], list[Rubbed | None], list[float]]


class TouchingForces:
    """Contact between the parts of the surface named by ``touching``, on one rank; updated when the unknowns have changed."""

    def __init__(self, body: Body, form: Form, displacement: Displacement, spent: Spent) -> None:
        """Raises ArithmeticError if parts overlap at rest by more than the smoothing plus the overlap that is removed."""
        self.unknowns, self.spent = displacement.unknowns, spent
        self.passes, self.rims = self._passes(body, form, displacement)
        self.now = list[tuple[Met, PressedPoints]]()
        self.seen = np.full(len(self.unknowns.x.array), np.nan)
        self.rubbing = [Rubbing(one, len(self.seen)) if one.law.friction else None for one in self.passes]
        self.rubbed, self.dissipated = list[Rubbed | None](), 0.0
        self.settled: State = np.array(self.unknowns.x.array), [], [], []
        self.move_to(body.frames[0])
        self.settle()
        depths = [(one.law, one.depth(met)) for one, (met, _) in zip(self.passes, self.now, strict=True)]
        for law in body.touching:
            seen = max(depth for one, depth in depths if one is law)
            left = max(seen, 0.0) + unseen(body.mesh, law) if law.relaxed else 0.0
            deep, most = max(seen, overlap(body, law)), law.smoothing + left
            if deep > most:  # deeper than the sum of the smoothing, the removed overlap and what points may miss
                raise ArithmeticError(
                    f'"{law.one}" and "{law.other}" overlap by {deep:.3g} mm; at most {most:.3g} mm is allowed'
                )
        self.overlap = max((depth for _, depth in depths), default=0.0)
        for one, (met, _) in zip(self.passes, self.now, strict=True):
            if one.law.relaxed or one.own:
                np.maximum.at(one.overlaps, met.points, one.law.smoothing - met.gap)
        self.seen = np.full_like(self.seen, np.nan)
        self.settle()

    def move_to(self, frame: float) -> None:
        """Subtract from now on the fraction of each overlap at rest that remains at ``frame``."""
        for one in self.passes:
            if (share := one.law.allowance(frame)) != one.share:
                one.share = share
                self.seen = np.full_like(self.seen, np.nan)

    def acting(self) -> list[float]:
        """The fractions of overlaps at rest that are subtracted."""
        return [one.share for one in self.passes]

    @staticmethod
    def _passes(body: Body, form: Form, displacement: Displacement) -> tuple[list[Pass], list[Pass | None]]:
        """Two passes for each law, one from each side (a single one if a part touches itself); and for each pass the skin around
        the other part, which the points of the pass must not touch. It is None without such a skin, or if it takes part in contact.
        """
        both = ((law, dict.fromkeys(((law.one, law.other), (law.other, law.one)))) for law in body.touching)
        sides = [(law, *pair) for law, pairs in both for pair in pairs]
        skins = local_facets(displacement.space.mesh, [beyond_rim(body, *pair) for _, *pair in sides])
        facets = partial(facets_of, displacement, body.mesh)
        own = {name: facets(form.regions[name]) for _, name, _ in sides}
        passes, rims = list[Pass](), list[Pass | None]()
        for (law, one, other), around in zip(sides, skins, strict=True):
            felt = law.around and len(around) > 0
            skin = facets(np.concatenate([form.regions[other], around])) if felt else own[other]
            kind = RayPass if law.own_normals else Pass
            passes.append(kind(law, own[one], skin, (one, other)))
            rims.append(Pass(law, own[one], facets(around), (one, other)) if len(around) and not felt else None)
        return passes, rims

    def look(self) -> None:
        """Find the contact at the current unknowns, unless they are those of the last search."""
        if not np.array_equal(self.seen, self.unknowns.x.array):
            with self.spent.on("contact"):
                self.seen = np.array(self.unknowns.x.array)
                none = [None] * len(self.passes)
                lasts, thens = ([met for met, _ in state] or none for state in (self.now, self.settled[1]))
                columns = zip(self.passes, lasts, thens, strict=True)
                before = self.settled[0]
                mets = [one.met(self.seen, one.law.smoothing, last, (before, then)) for one, last, then in columns]
                self.now = [(met, one.pressed(met)) for one, met in zip(self.passes, mets, strict=True)]
                pairs = zip(self.rubbing, mets, strict=True)
                self.rubbed = [one.rubbed(met, self.seen) if one and one.acts else None for one, met in pairs]

    def add_residual(self, residual: Floats, moves: Floats | None) -> None:
        """Add the forces to ``residual`` (n,), with their first-order change due to changes ``moves`` (n,) of the unknowns."""
        self.look()
        acting: list[PressedPoints | Rubbed] = [*(one for _, one in self.now), *filter(None, self.rubbed)]
        for one in acting:
            np.subtract.at(residual, one.dofs, np.einsum("nr,nrw->nw", one.pull, one.rows))
        if moves is not None and moves.any():
            residual += self.tangent() @ moves

    def tangent(self) -> csr_array:
        """The derivative (n, n) of the residual with respect to the unknowns."""
        self.look()
        size, found = len(self.seen), csr_array((len(self.seen), len(self.seen)))
        acting: list[PressedPoints | Rubbed] = [*(one for _, one in self.now), *filter(None, self.rubbed)]
        mets = [(one, met) for one, (met, _) in zip(self.passes, self.now, strict=True)]
        acting += [one.shaded(met) for one, met in mets if isinstance(one, RayPass) and isinstance(met, Hits)]
        for one in acting:
            count, five, width = one.rows.shape
            columns = np.broadcast_to(one.dofs[:, None], one.rows.shape).ravel()
            starts = np.arange(0, count * five * width + 1, width)
            rows, scaled = (
                csr_array((values.ravel(), columns, starts), shape=(count * five, size))
                for values in (one.rows, one.second @ one.rows)
            )
            found += rows.T @ scaled
        found.sort_indices()
        return csr_array(found)

    def forces(self) -> dict[str, tuple[Floats, Floats]]:
        """The force (3,) [N] of each part on the other, by name, and its moment (3,) [N mm] about the origin."""
        self.look()
        found = dict[str, tuple[Floats, Floats]]()
        for one, (met, contact), rubbed in zip(self.passes, self.now, self.rubbed, strict=True):
            if one.own is not None:  # the forces of a part on itself sum to 0
                continue
            forces, (here, there) = contact.force, one.names
            both = (1, f"{there} on {here}", met.here.point), (-1, f"{here} on {there}", met.there.point)
            for sign, name, places in both:
                force, moment = found.get(name, (np.zeros(3), np.zeros(3)))
                pull = sign * forces
                found[name] = force + pull.sum(axis=0), moment + np.cross(places, pull).sum(axis=0)
                if rubbed:  # friction acts at the same points of both parts
                    drag = sign * rubbed.pull[:, :3]
                    turn = np.cross(met.here.point, drag).sum(axis=0)
                    found[name] = found[name][0] + drag.sum(axis=0), found[name][1] + turn
        return found

    def scalars(self) -> dict[str, float]:
        """The maximum ``touching_depth`` [mm] and ``touching_pressure`` [MPa] of all points; with several laws, the maximum
        pressure of each law (``Touching.pressure_name``); ``touching_area`` [mm2], the undeformed area under pressure, averaged
        over both sides; ``touching_points``, the number of points under pressure; ``touching_overlap_at_rest`` [mm], the depth of
        the deepest point at rest, if the overlap is removed; and ``touching_friction_work`` [N mm], dissipated since the start.
        """
        self.look()
        pairs = list(zip(self.passes, self.now, strict=True))
        removed = any(one.law.relaxed for one in self.passes)
        more = {"touching_overlap_at_rest": self.overlap} if removed else {}
        more |= {"touching_friction_work": self.dissipated} if any(self.rubbing) else {}
        most = dict[str, float]()
        for one, (met, _) in pairs:
            name = one.law.pressure_name
            most[name] = max(most.get(name, 0.0), float(one.pressure(met)[0].max(initial=0.0)))
        more |= most if len(most) > 1 else {}
        return {
            "touching_depth": max(one.depth(met) for one, (met, _) in pairs),
            "touching_pressure": max(most.values()),
            "touching_area": sum(float(one.areas[met.points] @ one.shares(met)) for one, (met, _) in pairs),
            "touching_points": float(sum(len(np.unique(met.points)) for met, _ in self.now)),
        } | more

    def settle(self) -> None:
        """Accept the current state as the start of the next step."""
        self.look()
        for one, (met, _), rubbed in zip(self.rubbing, self.now, self.rubbed, strict=True):
            if one:
                one.settle(met, rubbed.held if rubbed else met.there.at, self.seen)
                self.dissipated += float(rubbed.lost.sum()) if rubbed else 0.0
        if any(self.rubbing):
            self.seen = np.full_like(self.seen, np.nan)  # the anchors have moved
            self.look()
        for side, (met, _) in zip(self.passes, self.now, strict=True):
            side.let_fall(met)
        self.settled = self.state

    @property
    def state(self) -> State:
        """The contact at the unknowns of the last search. It determines the facets on which points stay in the next search."""
        return self.seen, self.now, self.rubbed, self.acting()

    def restoring(self) -> Callable[[], None]:
        """The function that restores the current contact after the unknowns have been restored."""
        return partial(self.go_back, self.state)

    def go_back(self, state: State | None = None) -> None:
        """Restore an earlier ``state``, by default the settled one, after the unknowns have been restored."""
        self.seen, self.now, self.rubbed, shares = state or self.settled
        if shares != self.acting():  # the pressures are those of another frame
            self.seen = np.full_like(self.seen, np.nan)

    def trouble(self, before: Floats, /) -> Trouble | None:
        """The trouble *diverged* if, since ``before`` (n,), a point went through the other part or slid past its rim or too far."""
        self.look()
        columns = self.passes, self.rims, self.settled[1], self.now, self.rubbed
        for one, rim, (last, _), (met, _), rubbed in zip(*columns, strict=True):
            own, other = (f'"{name}"' for name in one.names)
            lost, way = one.through(before, last, self.seen, met), f"went through the other side, {other}"
            if rim and not len(lost):
                lost, way = rim.slid(self.seen, last.points, met.points), f"slid past the rim of {other}"
            if rubbed and not len(lost):
                lost, way = (
                    met.points[rubbed.far > _FAR],
                    f"slid on {other} by more than the size of a facet within a load step",
                )
            if len(lost):
                rest, now = (place_of(one.places(at)[lost[0]]) for at in (np.zeros_like(before), self.seen))
                where = f"a point of {own}, at {rest} in the rest state and at {now} after the step,"
                return Trouble("diverged", f"contact gives way: {where} {way}")
        return None


def touching_of(body: Body, form: Form, displacement: Displacement, spent: Spent) -> TouchingForces | None:
    """The contact between parts of the surface of a ``body``; None if no parts may touch."""
    return TouchingForces(body, form, displacement, spent) if body.touching else None
