"""Positions and unknowns at reference points of cells, from tabulated basis functions; nothing is compiled."""

from dataclasses import dataclass
from typing import Any

import basix
import numpy as np
from dolfinx import fem, mesh

from fem_reference.foundations.mesh import Floats, Ints


def geometry(msh: mesh.Mesh, points: Floats, cells: Ints | slice) -> tuple[Floats, Floats]:
    """The rest positions (m, q, 3) [mm] of reference ``points`` (q, 3) in ``cells`` (m,), and their slopes (m, q, 3, 3) there."""
    kind, degree = basix.CellType[msh.topology.cell_name()], msh.geometry.cmap.degree
    element = basix.create_element(basix.ElementFamily.P, kind, degree, basix.LagrangeVariant.gll_warped)
    values = element.tabulate(1, points)[..., 0]
    nodes = msh.geometry.x[msh.geometry.dofmap[cells]]
    return np.einsum("qk,mki->mqi", values[0], nodes), np.einsum("jqk,mki->mqij", values[1:], nodes)


@dataclass(frozen=True, eq=False)
class Tabulated:
    """A part of the unknowns at reference points of cells: the ``values`` (q, k) of basis functions there, their ``slopes``
    (3, q, k) along the reference coordinates, and the ``unknowns`` (m, k, c) of the cells' nodes.
    """

    values: Floats
    slopes: Floats
    unknowns: Ints

    def at(self, unknowns: Floats) -> Floats:
        """The values (m, q, c) of ``unknowns`` (n,)."""
        return np.asarray(self.values @ unknowns[self.unknowns])

    def slopes_at(self, unknowns: Floats) -> Floats:
        """Their slopes (m, q, c, 3)."""
        return np.stack([slope @ unknowns[self.unknowns] for slope in self.slopes], axis=-1)


def tabulate(space: fem.FunctionSpace, unknowns: Ints, points: Floats) -> Tabulated:
    """A part of the unknowns at reference ``points`` (q, 3), from its ``space`` and the ``unknowns`` (m, k, c) of the cells'
    nodes.
    """
    element: Any = space.element.basix_element
    values, *slopes = element.tabulate(1, points)[..., 0]
    return Tabulated(values, np.stack(slopes), unknowns)


class Displacement:
    """The displacement among the ``unknowns`` of a body: its ``space`` and the unknowns ``dofs`` (n, 3) of its nodes."""

    def __init__(self, unknowns: fem.Function) -> None:
        self.unknowns = unknowns
        self.space, parents = unknowns.function_space.sub(0).collapse()
        self.dofs: Ints = np.reshape(np.asarray(parents, np.int64), (-1, 3))

    def tabulated(self, points: Floats, count: int) -> Tabulated:
        """At reference ``points`` (q, 3) of the first ``count`` cells."""
        return tabulate(self.space, self.dofs[self.space.dofmap.list[:count]], points)
