"""Linear solvers change the time and not the answer: the same body by each solver of the reference."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem_reference.assessment.catalogue import Entry, Finding, Lab
from fem_reference.effects import make
from fem_reference.foundations.mesh import Floats
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Along, Rest, Turn
from fem_reference.verification.parts import neo_hooke, zero

ELEMENT = "P2/P1"
# [N, mm3] that ends Newton's method; the softest motion of the bar has a stiffness of about mu w^4 / l^3 = 0.006 N/mm.
RESIDUAL = 1e-11
MUSCLE = (
    *neo_hooke(0.01, 10.0),
    make("fibre_passive", stress="300 kPa", p1=0.05, p2=6.6, optimal_stretch=1.0, linear_from=1.4),
)


@dataclass(frozen=True, eq=False)
class Compared:
    """A bar of muscle, one end fixed, the other turned by 1 rad about an oblique axis: solved directly, in double precision, and by
    ``solver`` with factorisations in ``precision``, up to ``residual``.
    """

    solver: str
    precision: str | None = None
    residual: float = RESIDUAL

    def difference(self, lab: Lab) -> Finding:
        """How far a node is at most from where it is by the direct solver [mm]."""
        direct = self._points(lab, "direct", "double", RESIDUAL)
        found = self._points(lab, self.solver, self.precision, self.residual)
        return Finding(float(np.linalg.norm(found - direct, axis=1).max()))

    def _points(self, lab: Lab, solver: str, precision: str | None, residual: float) -> Floats:
        mesh = shapes.box((3, 3, 7), (10.0, 10.0, 25.0), "tetrahedron")
        turn = Turn((1.0, 0.0, 2.0), 1.0, (5.0, 5.0, 12.5))
        fixed = (Prescribed("z0", "z0", (0, 1, 2), Rest()), Prescribed("z1", "z1", (0, 1, 2), turn))
        body = Body(mesh, MUSCLE, fixed, (0.0, 1.0), Along((0.0, 0.0, 1.0)))
        settings: dict[str, Any] = {
            "linear_solver": solver,
            "precision": precision,
            "residual": residual,
            "first_step": 0.25,
        }
        return lab.solve(body, ELEMENT, **settings).last.points


_LAGGED = Entry(
    name="lagged_factorisation",
    group="linear solvers",
    title="Turned bar of muscle by lagged factorisations in double precision and by direct ones: largest difference of a node",
    unit="mm",
    truth=zero,
    within=1e-9,
    relative=False,
    because="Both end where the residual is below 1e-11 N, far below it as a rule; where the bar is softest (some 0.006 N/mm) that "
    "would leave 2e-9 mm.",
    kind="property",
    source="The solution of an equation does not depend on how it was found.",
    measure=Compared("lagged", "double").difference,
    negative_control="Newton's method ends at a residual of 1e-2 N.",
    with_negative_control=Compared("lagged", "double", 1e-2).difference,
)
_SINGLE = replace(
    _LAGGED,
    name="lagged_factorisation_single",
    title="Turned bar of muscle by lagged factorisations in single precision and by direct ones in double: largest difference of "
    "a node",
    measure=Compared("lagged", "single").difference,
    with_negative_control=Compared("lagged", "single", 1e-2).difference,
)
_MULTIGRID = replace(
    _LAGGED,
    name="multigrid",
    title="Turned bar of muscle by multigrid between P2 and P1 and by direct factorisations: largest difference of a node",
    within=1e-8,
    measure=Compared("multigrid").difference,
    with_negative_control=Compared("multigrid", residual=1e-2).difference,
)

ENTRIES = (_LAGGED, _SINGLE, _MULTIGRID)
