"""The mesh in DOLFINx: numbers of nodes and cells change nothing."""

import numpy as np
import pytest

from fem_reference.problems.body import Cells
from fem_reference.problems.paths import Turn
from tests.solvers.fenicsx.test_body import BOTH, box, settings, turned

pytestmark = pytest.mark.slow


@BOTH
def test_the_order_of_nodes_and_cells_does_not_matter(element, session) -> None:
    mesh, random = box(element, (1, 2, 2)), np.random.default_rng(4)
    new = random.permutation(len(mesh.points))  # where each node goes
    points = np.empty_like(mesh.points)
    points[new] = mesh.points
    cells = new[mesh.cells][random.permutation(len(mesh.cells))]
    facets = {name: new[region] for name, region in mesh.facets.items()}
    other = Cells(points, cells, mesh.kind, mesh.degree, facets)
    turn = Turn((1.0, 0.0, 2.0), 0.5, (0.5, 0.5, 1.0))
    first, second = (session.solve(turned(one, turn), settings(element)).last for one in (mesh, other))
    # Both end within Newton's residual of 1e-12 N, over a stiffness of 1e-3 N/mm.
    assert second.points[new] == pytest.approx(first.points, abs=1e-9)
    assert second.forces["top"] == pytest.approx(first.forces["top"], abs=1e-10)
