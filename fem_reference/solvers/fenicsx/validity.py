"""Checks of a state by means over cells: laws are within their ranges, and the body has not collapsed.

Means are used because the exact strain at the rim of an attachment is unbounded: det F at a vertex there may be far from 1 in a
cell that has kept its volume. Even means of single cells may be far from 1 (0.37 and 1.9 in ``gluteus_maximus``, with a bulk
modulus of a thousand shear moduli). In such a case a law is reported as outside its range, but the body has not collapsed.
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

# A cell with less than this fraction of its rest volume has collapsed, whatever the ranges of laws: about four fifths of muscle are
# water, which does not leave it in a motion (Ward and Lieber 2005, Density and hydration of fresh and fixed human skeletal muscle),
# and a fifth of the volume would barely contain the solid part. A body has collapsed if collapsed cells make up more than this
# fraction of its rest volume; those that collapse at a rim make up less, the smaller they are.
COLLAPSED, SHARE = 0.2, 0.01
_SCALARS = {"V/V0": "cell_volume_ratio", "fibre stretch": "cell_fibre_stretch"}


@dataclass(frozen=True)
class Outside:
    """A ``law``, as scene files name it, outside the range of its ``limit``, with its worst value."""

    law: str
    limit: Limit
    extreme: Extreme

    def __str__(self) -> str:
        below = self.extreme.value < self.limit.low
        bound = f"below {self.limit.low:.3g}" if below else f"above {self.limit.high:.3g}"
        return f"{self.limit.measure} is {self.extreme}, {bound}"


class Ranges:
    """The laws that were outside their ranges over the states of a run: for each law, the frames and the value that was outside."""

    def __init__(self) -> None:
        self.found: dict[str, dict[float, str]] = {}

    def add(self, frame: float, found: Iterable[Outside]) -> None:
        """Add the laws outside their ranges at a frame."""
        for one in found:
            self.found.setdefault(one.law, {}).setdefault(frame, str(one))

    def facts(self) -> list[Any]:
        """The content, in the types of JSON."""
        return [[law, list(states.items())] for law, states in self.found.items()]

    def know(self, facts: list[Any]) -> None:
        """Restore the content from ``facts``."""
        self.found = {law: dict(states) for law, states in facts}

    def __str__(self) -> str:
        firsts = [(law, len(states), *next(iter(states.items()))) for law, states in self.found.items()]
        return "".join(
            f"; {law} is outside the range of its validity in {count} of the states reached, "
            f"first at frame {frame:g}: {one}"
            for law, count, frame, one in firsts
        )


class Validity:
    """The means, over each cell of a body, of the measures that its laws limit. Its methods are collective."""

    def __init__(self, determinants: Determinants, form: Form, body: Body) -> None:
        self.mesh, self.cells, self.effects = determinants.mesh, determinants.cells, body.effects
        self.values: dict[str, Callable[[], Floats]] = {"V/V0": determinants.values_now}
        if any(limit.measure == "fibre stretch" for effect in body.effects for limit in effect.limits()):
            # The expression is compiled here, by all ranks together, even ranks without cells.
            stretch, mine = compiling.expression(form.fibre_stretch, form.rule[0]), np.arange(len(self.cells))
            self.values["fibre stretch"] = lambda: np.asarray(stretch.eval(self.mesh, mine.astype(np.int32)))
        self.volumes, self.centres = volumes_and_centres(self.mesh, len(self.cells), form.rule)
        self.here = State(F=(), regions=body.shares(self.centres, self.cells))

    def volume_ratio(self) -> float:
        """The ratio of the present volume of the body to its rest volume."""
        now = self.volumes.ravel() @ self.values["V/V0"]()
        present, rest = self.mesh.comm.allreduce(np.array([now, self.volumes.sum()]), MPI.SUM)
        return float(present / rest)

    def trouble(self, _: Floats, /) -> Trouble | None:
        """The trouble *collapsed* if more than a negligible part of the body has lost too much volume."""
        means = self._means("V/V0")
        volumes = self.volumes.sum(axis=1)
        lost, whole = self.mesh.comm.allreduce(np.array([volumes[means < COLLAPSED].sum(), volumes.sum()]), MPI.SUM)
        if lost <= SHARE * whole:
            return None
        why = f"{100 * lost / whole:.0f} % of the body collapsed: V/V0 is {self._extreme(means)}, below {COLLAPSED:g}"
        return Trouble("collapsed", why)

    def examine(self, frame: float) -> tuple[dict[str, float], list[Outside]]:
        """The extremes of the means at ``frame`` and ``outside_law``, the number of cells outside a law's range; and these laws."""
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
                acts = self.here.share(region_of(effect)) > 1 / 2  # in the middle of a cell
                there = np.where(acts, means, np.clip(means, limit.low, limit.high))
                outside |= (there < limit.low) | (there > limit.high)
                low, high = self._extreme(there), self._extreme(there, -1.0)
                found += [Outside(name_of(effect), limit, low)] if low.value < limit.low else []
                found += [Outside(name_of(effect), limit, high)] if high.value > limit.high else []
        return scalars | {"outside_law": float(self.mesh.comm.allreduce(int(outside.sum()), MPI.SUM))}, found

    def _means(self, measure: str) -> Floats:
        """The means over the cells of this rank (n,)."""
        if len(self.cells) == 0:
            return np.zeros(0)
        return np.average(self.values[measure]().reshape(self.volumes.shape), axis=1, weights=self.volumes)

    def _extreme(self, means: Floats, sign: float = 1.0) -> Extreme:
        """The mean with the smallest ``sign * means`` (n,) over all ranks."""
        return least(self.mesh.comm, means, self.cells, self.centres, sign=sign)


def volumes_and_centres(msh: mesh.Mesh, count: int, rule: Rule) -> tuple[Floats, Floats]:
    """The rest volumes (n, q) [mm3] of the points of a ``rule`` in the first ``count`` cells, and the centres (n, 3) [mm]."""
    points, weights = rule
    places, slopes = geometry(msh, points, slice(count))
    volumes = weights * np.abs(np.linalg.det(slopes))
    return volumes, np.einsum("nq,nqi->ni", volumes, places) / volumes.sum(axis=1)[:, None]
