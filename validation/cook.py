"""Cook's membrane in plane strain: the displacement of the top right corner of a clamped, tapered panel under a shear load.

The panel has the corners (0, 0), (48, 44), (48, 60), (0, 44) mm. The side x = 0 is clamped, and a dead traction along y,
constant per rest length, acts on the side x = 48. The result is the displacement along y of the corner (48, 60). There is no
closed form: the numbers come from our second solver :mod:`validation.plane_strain`, on grids that are graded geometrically
towards all four sides, with polynomial degree and number of layers increased until the result is constant. Geometry: Cook,
J. Struct. Div. ASCE 100 (1974) 1851-1863. Data at finite strain: de Souza Neto et al., Int. J. Solids Struct. 33
(1996) 3277-3296, doi 10.1016/0020-7683(95)00259-6, and Elguedj et al., Comput. Methods Appl. Mech. Eng. 197 (2008) 2732-2762,
doi 10.1016/j.cma.2008.01.012.
"""

from dataclasses import dataclass

import numpy as np

from validation import plane_strain
from validation.plane_strain import Floats, Law, Rested

CORNERS = ((0.0, 0.0), (48.0, 44.0), (48.0, 60.0), (0.0, 44.0))
SIDE = 16.0


@dataclass(frozen=True)
class Membrane:
    """A panel with ``shear`` modulus and ``bulk`` modulus [MPa] under ``force`` [N per mm of thickness], and the displacement
    of its corner, ``tip`` [mm], with its uncertainty ``error`` [mm].
    """

    shear: float
    bulk: float
    force: float
    tip: float
    error: float

    @property
    def traction(self) -> float:
        """Force per rest area [MPa] on the loaded side, along y."""
        return self.force / SIDE


# Small strain, linear in force / E, with E = 1 MPa and F = 1 N/mm. (degree, layers) = (6, 4), (8, 5), (10, 6) give 22.610454,
# 22.610488, 22.610492 for nu = 1/3, and 19.428307, 19.428290, 19.428289 for nu = 0.4999.
COMPRESSIBLE = Membrane(shear=3 / 8, bulk=1.0, force=1.0, tip=22.61049, error=1e-5)
NEARLY_INCOMPRESSIBLE = Membrane(shear=1 / 2.9998, bulk=1 / 0.0006, force=1.0, tip=19.42829, error=1e-5)

# Finite strain, W = mu/2 (J^(-2/3) tr C - 3) + K/2 (J - 1)^2. At the full load the material at the clamped corner (0, 44) is
# compressed so far that a free surface is no longer smooth (least stretch 0.2, and less on finer grids). So the folds depend on
# the grid, and on finer grids Newton's method finds no equilibrium. Degrees 6, 8, 10 with 2 layers at that corner give
# 6.9344, 6.9348, 6.9351; degrees 6, 7, 8 with 3 layers give 6.9354, 6.9363, 6.9341. At a quarter of the load there are
# no folds: (6, 3), (6, 4), (8, 4) give 1.945633, 1.945646, 1.945648.
FINITE = Membrane(shear=80.194, bulk=400889.8, force=100.0, tip=6.935, error=1.5e-3)
FINITE_QUARTER = Membrane(shear=80.194, bulk=400889.8, force=25.0, tip=1.94565, error=1e-5)

# Published values of the tip [mm]. Small strain, nu = 1/3, E = 70 MPa, 6.25 MPa on the side: CoFEA's quadratic hexahedra in
# CalculiX, Code_Aster and Elmer (three dimensions). OpenGeoSys, 30 by 30 linear cells, F = 100 N/mm: small strain (B-bar)
# and finite strain (F-bar). Compressible neo-Hooke at finite strain, E = 200 MPa, nu = 0.35, 4 MPa on the side: Mueller,
# thesis, Universitaet Duisburg-Essen 2015.
COFEA = (32.27, 32.20, 32.28)
OPENGEOSYS_SMALL = 8.000
OPENGEOSYS_FINITE = 6.891
MUELLER = 6.1469


def _ticks(layers: int) -> Floats:
    """Ticks of [0, 1] graded towards both ends in ``layers``, each a fifth as wide as the previous layer."""
    half = plane_strain.graded(layers, 0.2) / 2
    return np.concatenate([half, 1 - half[-2::-1]])


def solve(law: Law, bulk: float, traction: float, order: int, layers: int, steps: int = 1) -> Rested:
    """The panel with ``law`` and ``bulk`` [MPa] under ``traction`` [MPa], applied in ``steps``, on cells of degree ``order`` graded
    towards all sides in ``layers``; the last node is the corner (48, 60).
    """
    ticks = _ticks(layers)
    body = plane_strain.grid(CORNERS, ticks, ticks, order)
    return plane_strain.rest(body, law, bulk, (0.0, traction), steps)


def small_strain_tip(membrane: Membrane, order: int, layers: int) -> float:
    """The displacement along y [mm] of the corner (48, 60) by Hooke's law, on a grid as in :func:`solve`."""
    law = plane_strain.small_strain(membrane.shear)
    return float(solve(law, membrane.bulk, membrane.traction, order, layers).displacement[-1, 1])


def finite_strain_tip(membrane: Membrane, order: int, layers: int, steps: int) -> float:
    """The displacement along y [mm] of the corner (48, 60) by the neo-Hookean law, on a grid as in :func:`solve`."""
    law = plane_strain.neo_hooke(membrane.shear)
    return float(solve(law, membrane.bulk, membrane.traction, order, layers, steps).displacement[-1, 1])
