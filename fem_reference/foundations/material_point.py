"""State at a point of a body, with the invariants and functions with which laws are written."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np


@dataclass(frozen=True)
class Functions:
    """Functions that an expression may call in addition to operators: numerical, symbolic or with derivatives.

    ``above(x, limit, then, otherwise)`` is ``then`` where ``x > limit``, else ``otherwise``; both must be finite everywhere.
    """

    exp: Callable[[Any], Any]
    log: Callable[[Any], Any]
    sqrt: Callable[[Any], Any]
    cos: Callable[[Any], Any]
    sin: Callable[[Any], Any]
    above: Callable[[Any, Any, Any, Any], Any]


def _above(x: Any, limit: Any, then: Any, otherwise: Any) -> Any:
    return np.where(x > limit, then, otherwise)


# A region's name with this prefix means the part of the body outside the region.
REST = "not "
NUMPY = Functions(np.exp, np.log, np.sqrt, np.cos, np.sin, _above)


class Moduli(NamedTuple):
    """Stiffness at rest [MPa], 0 if absent: ``shear`` (transverse to any fibres), ``bulk``, and the stress scale of ``fibres``."""

    shear: float = 0.0
    bulk: float = 0.0
    fibres: float = 0.0


@dataclass(frozen=True)
class State:
    """State at a point, from which expressions are computed. Each entry is a number, an array over points or a symbolic expression.

    ``F``: the deformation gradient, ``F[i][k] = dx_i / dX_k``. ``displacement``: (3,) [mm]. ``pressure``: the pressure unknown
    [MPa] of a mixed formulation, None if no effect adds it. ``fibre``: the unit vector (3,) along the fibres at rest, None without
    fibres. ``amount``: the factor of the effect (see :meth:`Effect.amount`). ``before``, ``F_before``: the displacement (3,) [mm]
    and the deformation gradient before the load step. ``predicted``: the displacement (3,) [mm] at constant velocity. ``rate``: 1
    over the duration of the step [1/s], 0 in a quasi-static step. ``regions``: the share of each region at the point.
    """

    F: Sequence[Sequence[Any]]
    displacement: Sequence[Any] = (0.0, 0.0, 0.0)
    pressure: Any = None
    fibre: Any = None
    amount: Any = 1.0
    before: Sequence[Any] = (0.0, 0.0, 0.0)
    predicted: Sequence[Any] = (0.0, 0.0, 0.0)
    F_before: Sequence[Sequence[Any]] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    rate: Any = 0.0
    regions: Mapping[str, Any] = field(default_factory=dict)
    functions: Functions = NUMPY

    def share(self, region: str) -> Any:
        """Share of a ``region`` at the point: ``"not NAME"`` is all of the body except the region NAME, ``""`` is all of it."""
        if region.startswith(REST):
            return 1 - self.regions[region.removeprefix(REST)]
        return self.regions[region] if region else 1.0

    @property
    def J(self) -> Any:
        """Determinant of F."""
        return sum(self.F[0][k] * entry for k, entry in enumerate(self.cofactors[0]))

    @property
    def cofactors(self) -> Sequence[Sequence[Any]]:
        """``J F^-T`` (3, 3), which maps an area vector at rest to the deformed area vector (Nanson)."""
        F = self.F
        after = {0: (1, 2), 1: (2, 0), 2: (0, 1)}
        return [
            [F[i][k] * F[j][m] - F[i][m] * F[j][k] for k, m in (after[column] for column in range(3))]
            for i, j in (after[row] for row in range(3))
        ]

    @property
    def C(self) -> Sequence[Sequence[Any]]:
        """``F^T F`` (3, 3)."""
        F = self.F
        return [[sum(F[i][k] * F[i][m] for i in range(3)) for m in range(3)] for k in range(3)]

    @property
    def I1(self) -> Any:
        """Trace of C."""
        return sum(self.F[i][k] ** 2 for i in range(3) for k in range(3))

    @property
    def I2(self) -> Any:
        """``((tr C)^2 - tr C^2) / 2``, the sum of the squared cofactors."""
        return sum(entry**2 for row in self.cofactors for entry in row)

    def square_stretch(self, direction: Sequence[Any]) -> Any:
        """Squared stretch ``direction . C direction`` of a line that is parallel to the unit vector ``direction`` (3,) at rest."""
        return sum(sum(F * a for F, a in zip(row, direction, strict=True)) ** 2 for row in self.F)

    @property
    def fibre_stretch(self) -> Any:
        """Isochoric stretch ``J^(-1/3) |F fibre|`` of the fibre."""
        return self.J ** (-1 / 3) * self.functions.sqrt(self.square_stretch(self.fibre))

    def stretched(self, along: Any) -> Sequence[Sequence[Any]]:
        """``F (l f f^T + l^(-1/2) (1 - f f^T))`` (3, 3): F after an isochoric stretch l (``along``) of the fibre f."""
        across = 1 / self.functions.sqrt(along)
        ends = [sum(F * a for F, a in zip(row, self.fibre, strict=True)) for row in self.F]
        return [
            [across * F + (along - across) * end * a for F, a in zip(row, self.fibre, strict=True)]
            for row, end in zip(self.F, ends, strict=True)
        ]

    def between(self, low: Any, high: Any, x: Any) -> Any:
        """Clip ``x`` to the bounds ``low`` and ``high``."""
        above = self.functions.above
        return above(x, high, high, above(x, low, x, low))


@dataclass(frozen=True)
class FieldState:
    """State of a scalar field at a point. ``gradient`` has one entry per coordinate; a test function needs no ``laplacian``."""

    value: Any
    gradient: Sequence[Any]
    laplacian: Any = 0.0


@dataclass(frozen=True)
class Place:
    """Point at which an effect on a scalar field acts. ``position``: (x, y, z), (x, y) or (x,); ``functions``: the functions that
    formulas may call, by name; ``upper``: the fraction of the element that lies above the mean y of all vertices.
    """

    position: Sequence[Any]
    functions: Mapping[str, Any]
    upper: Any


def fibre_tension(energy: Callable[[State], Any], stretch: float, step: float = 1e-6) -> float:
    """Force per unit rest area [MPa] along fibres at a ``stretch`` and constant volume, by central differences of ``energy``."""

    def along(length: float) -> float:
        across = length**-0.5
        F = ((length, 0.0, 0.0), (0.0, across, 0.0), (0.0, 0.0, across))
        return float(energy(State(F=F, pressure=0.0, fibre=(1.0, 0.0, 0.0))))

    return (along(stretch + step) - along(stretch - step)) / (2 * step)
