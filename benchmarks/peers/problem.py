"""The problem that the reference and its peers solve: a fusiform muscle with fibres, nearly incompressible, bent and stretched."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks import bodies
from fem_reference.effects import make
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.problems.body import Body, Cells, Prescribed
from fem_reference.problems.paths import Rest

# Its upper end turns by ANGLE [rad] and its middle line becomes longer by STRETCH, in so many FRAMES: each is one load step.
ANGLE, STRETCH, FRAMES = np.pi / 3, 0.1, 12
# What ends Newton's iteration everywhere: the Euclidean norm of the residual [N] of nodal forces.
RESIDUAL = 1e-8
# Degree of the polynomials that are integrated exactly on a cell: 8 points in a hexahedron, 4 in a tetrahedron.
QUADRATURE = {"Q1/P0": 3, "P2/P0": 2, "P2/P1": 2}


@dataclass(frozen=True)
class Bend:
    """The middle line, straight along z from the origin, becomes an arc in the plane of x and z, and longer; sections across it
    stay what they are.
    """

    def __call__(self, points: Floats, frame: float) -> Floats:
        """The displacement (n, 3) [mm] of rest points (n, 3)."""
        share = frame / FRAMES
        if share == 0:
            return np.zeros_like(points)
        x, y, z = points.T
        radius = (1 + STRETCH * share) * bodies.LENGTH / (ANGLE * share)
        angle = ANGLE * share * z / bodies.LENGTH
        arms = radius - x
        return np.stack([radius - arms * np.cos(angle), y, arms * np.sin(angle)], axis=1) - points


@dataclass(frozen=True, eq=False)
class Muscle:
    """The problem in an ``element``: its ``body``, and of that what a peer needs as arrays and numbers."""

    element: str
    body: Body

    @property
    def mesh(self) -> Cells:
        """Straight cells."""
        return self.body.mesh

    @property
    def fibres(self) -> Floats:
        """Unit vectors (m, 3) along the fibres in the cells."""
        assert self.body.fibre is not None
        cells = np.arange(len(self.mesh.cells))
        return self.body.fibre(cells, self.mesh.points[self.mesh.cells].mean(axis=1))

    @property
    def law(self) -> dict[str, float]:
        """The parameters of the effects by name [MPa]."""
        return {name: float(value) for effect in self.body.effects for name, value, _ in effect.parameters}

    def fixed(self, points: Floats) -> tuple[Ints, Ints]:
        """Which of ``points`` (n, 3), nodes at rest, are on the lower and on the upper end."""
        z = points[:, 2]
        return np.flatnonzero(np.isclose(z, 0, atol=1e-9)), np.flatnonzero(np.isclose(z, bodies.LENGTH, atol=1e-9))


def muscle(element: str, rings: int, slices: int, frames: int = FRAMES) -> Muscle:
    """The fusiform body of ``bodies`` with other motion, its first ``frames`` load steps."""
    body = bodies.fusiform(element, rings, slices)
    ends = (
        Prescribed("bottom", "bottom", (0, 1, 2), Rest()),
        Prescribed("top", "top", (0, 1, 2), Bend()),
    )
    return Muscle(element, replace(body, prescribed=ends, frames=tuple(map(float, range(frames + 1)))))


def tension(law: dict[str, float], stretch: Floats) -> tuple[Floats, Floats]:
    """``l dW/dl`` [MPa] of ``fibre_passive_febio`` and its slope in the stretch l."""
    c3, c4, c5, end = (law[name] for name in ("c3", "c4", "c5", "linear_from"))
    growing = np.exp(c4 * (np.clip(stretch, 1, end) - 1))
    beyond = np.maximum(stretch - end, 0)
    slope = np.where(stretch > end, c5, np.where(stretch > 1, c3 * c4 * growing, 0))
    return c3 * (growing - 1) + c5 * beyond, slope


def facts() -> dict[str, Any]:
    """The problem in numbers, and its effects in words."""
    return {
        "effects": ", ".join(make(name, **parameters).title for name, parameters in bodies.EFFECTS.items()),
        "turned_degrees": round(math.degrees(ANGLE), 6),
        "stretched_percent": 100 * STRETCH,
        "load_steps": FRAMES,
        "residual_N": RESIDUAL,
    }
