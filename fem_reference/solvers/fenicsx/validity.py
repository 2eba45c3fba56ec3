"""Checks, based on cell averages, that each law is inside its range of validity and that the body has not collapsed.

The checks use averages over cells because the exact strain at the rim of an attachment is unbounded. Det F at a vertex on the rim
may be far from 1 although the cell has kept its volume. Even the average over a single cell may be far from 1: in
``gluteus_maximus``, whose bulk modulus is a thousand times its shear modulus, averages are as low as 0.37 and as high as 1.9. For
such a cell the check reports that a law is outside its range, but not that the body has collapsed.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import mesh
from mpi4py import MPI

from fem_reference.effects import State, name_of, region_of
from fem_reference.foundations.limits import Limit
from fem_reference.foundations.mesh import Floats
from fem_reference.problems.body import Body
from fem_reference.solvers.common.state_checks import Trouble
from fem_reference.solvers.fenicsx import compiling
from fem_reference.solvers.fenicsx.determinants import Determinants, Extreme, least
from fem_reference.solvers.fenicsx.forms import Form, Rule
from fem_reference.solvers.fenicsx.meshes import geometry

# A cell has collapsed if less than the fraction COLLAPSED of its rest volume is left, whatever the ranges of the laws. About four
# fifths of muscle are water, which does not leave the muscle during a motion (Ward and Lieber 2005, Density and hydration of fresh
# and fixed human skeletal muscle), and a fifth of the volume would barely contain the solid part. A body has collapsed if collapsed
# cells make up more than the fraction SHARE of its rest volume. If only cells at the rim of an attachment collapse, they make up
# a smaller fraction, which decreases further on finer meshes.
COLLAPSED, SHARE = 0.2, 0.01
_SCALARS = {"V/V0": "cell_volume_ratio", "fibre stretch": "cell_fibre_stretch"}


@dataclass(frozen=True)
class Outside:
    """A law that is outside its range of validity.

    ``law``: name of the law in scene files. ``limit``: the range and the measure that it limits. ``extreme``: the worst value.
    """

    law: str
    limit: Limit
    extreme: Extreme

    def __str__(self) -> str:
        below = self.extreme.value < self.limit.low
        bound = f"below {self.limit.low:.3g}" if below else f"above {self.limit.high:.3g}"
        return f"{self.limit.measure} is {self.extreme}, {bound}"


class Ranges:
    """A record of the laws that were outside their ranges during a run.

    ``found``: for each law, a dictionary from the frame to a text that states the value outside the range.
    """

    def __init__(self) -> None:
        self.found: dict[str, dict[float, str]] = {}

    def add(self, frame: float, found: Iterable[Outside]) -> None:
        """Record the laws that are outside their ranges at a ``frame``. Only the first value of a law at a frame is kept."""
        for one in found:
            self.found.setdefault(one.law, {}).setdefault(frame, str(one))

    def facts(self) -> list[Any]:
        """The record as a list that can be written as JSON."""
        return [[law, list(states.items())] for law, states in self.found.items()]

    def know(self, facts: list[Any]) -> None:
        """Restore the record from a list that :meth:`facts` returned."""
        self.found = {law: dict(states) for law, states in facts}

    def __str__(self) -> str:
        firsts = [(law, len(states), *next(iter(states.items()))) for law, states in self.found.items()]
        return "".join(
            f"; {law} is outside its range of validity in {count} of the states reached, "
            f"first at frame {frame:g}: {one}"
            for law, count, frame, one in firsts
        )


class Validity:
    """Checks of the cell means of V/V0 and, if a law limits it, of the fibre stretch. All MPI ranks must call each method."""

    def __init__(self, determinants: Determinants, form: Form, body: Body) -> None:
        self.mesh, self.cells, self.effects = determinants.mesh, determinants.cells, body.effects
        self.values: dict[str, Callable[[], Floats]] = {"V/V0": determinants.values_now}
        if any(limit.measure == "fibre stretch" for effect in body.effects for limit in effect.limits()):
            # All ranks must compile the expression together, including ranks without cells.
            stretch, mine = compiling.expression(form.fibre_stretch, form.rule[0]), np.arange(len(self.cells))
            self.values["fibre stretch"] = lambda: np.asarray(stretch.eval(self.mesh, mine.astype(np.int32)))
        self.volumes, self.centres = volumes_and_centres(self.mesh, len(self.cells), form.rule)
        self.here = State(F=(), regions=body.shares(self.centres, self.cells))

    def volume_ratio(self) -> float:
        """The present volume of the body divided by its rest volume."""
        now = self.volumes.ravel() @ self.values["V/V0"]()
        present, rest = self.mesh.comm.allreduce(np.array([now, self.volumes.sum()]), MPI.SUM)
        return float(present / rest)

    def trouble(self, _: Floats, /) -> Trouble | None:
        """The trouble *collapsed* if collapsed cells make up more than the fraction ``SHARE`` of the rest volume, else None."""
        means = self._means("V/V0")
        volumes = self.volumes.sum(axis=1)
        lost, whole = self.mesh.comm.allreduce(np.array([volumes[means < COLLAPSED].sum(), volumes.sum()]), MPI.SUM)
        if lost <= SHARE * whole:
            return None
        why = f"{100 * lost / whole:.0f} % of the body collapsed: V/V0 is {self._extreme(means)}, below {COLLAPSED:g}"
        return Trouble("collapsed", why)

    def examine(self, frame: float) -> tuple[dict[str, float], list[Outside]]:
        """Examine the state at ``frame``. Returns scalars by name, and the laws that are outside their ranges.

        The scalars are, for each measure, the minimum and maximum of its cell means, and ``outside_law``, the number of cells in
        which any law is outside its range.
        """
        scalars: dict[str, float] = {}
        found: list[Outside] = []
        outside = np.zeros(len(self.cells), bool)
        acting = [effect for effect in self.effects if effect.amount(frame) != 0]
        limits = [(effect, limit) for effect in acting for limit in effect.limits()]
        for measure in self.values:
            means = self._means(measure)
            low, high = self._extreme(means), self._extreme(means, -1.0)
            scalars |= {f"min_{_SCALARS[measure]}": low.value, f"max_{_SCALARS[measure]}": high.value}
            for effect, limit in [one for one in limits if one[1].measure == measure]:
                acts = self.here.share(region_of(effect)) > 1 / 2  # evaluated at the centroid of each cell
                there = np.where(acts, means, np.clip(means, limit.low, limit.high))
                outside |= (there < limit.low) | (there > limit.high)
                low, high = self._extreme(there), self._extreme(there, -1.0)
                found += [Outside(name_of(effect), limit, low)] if low.value < limit.low else []
                found += [Outside(name_of(effect), limit, high)] if high.value > limit.high else []
        return scalars | {"outside_law": float(self.mesh.comm.allreduce(int(outside.sum()), MPI.SUM))}, found

    def _means(self, measure: str) -> Floats:
        """Mean (n,) of a ``measure`` over each of the n cells of this rank."""
        if len(self.cells) == 0:
            return np.zeros(0)
        return np.average(self.values[measure]().reshape(self.volumes.shape), axis=1, weights=self.volumes)

    def _extreme(self, means: Floats, sign: float = 1.0) -> Extreme:
        """The smallest of ``means`` (n,) over the cells of all ranks, or the largest if ``sign`` is -1."""
        return least(self.mesh.comm, means, self.cells, self.centres, sign=sign)


def volumes_and_centres(msh: mesh.Mesh, count: int, rule: Rule) -> tuple[Floats, Floats]:
    """Rest volumes and centroids of the first n = ``count`` cells of a mesh.

    ``rule``: quadrature points and weights. The volumes (n, q) [mm3] are the parts of each cell that the rule assigns to its q
    points; the centroids (n, 3) are in mm.
    """
    points, weights = rule
    places, slopes = geometry(msh, points, slice(count))
    volumes = weights * np.abs(np.linalg.det(slopes))
    return volumes, np.einsum("nq,nqi->ni", volumes, places) / volumes.sum(axis=1)[:, None]
