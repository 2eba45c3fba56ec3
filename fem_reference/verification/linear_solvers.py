"""Linear solvers change the time and not the answer: the same body by each solver of the reference."""

from dataclasses import replace
from typing import Any

from fem_reference.assessment.catalogue import Entry, Lab
from fem_reference.effects import make
from fem_reference.foundations.mesh import Floats
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Along, Turn
from fem_reference.verification.parts import clamped, control, farthest, neo_hooke

# [N, mm3] that ends Newton's method; the softest motion of the bar has a stiffness of about mu w^4 / l^3 = 0.006 N/mm.
RESIDUAL = 1e-11


def solved(lab: Lab, solver: str, precision: str | None, residual: float) -> Floats:
    """A bar of muscle, one end clamped, the other turned by 1 rad about an oblique axis: its nodes (n, 3) [mm]."""
    mesh = shapes.box((3, 3, 7), (10.0, 10.0, 25.0), "tetrahedron")
    passive = make("fibre_passive", stress="300 kPa", p1=0.05, p2=6.6, optimal_stretch=1.0, linear_from=1.4)
    turned = Prescribed("z1", "z1", (0, 1, 2), Turn((1.0, 0.0, 2.0), 1.0, (5.0, 5.0, 12.5)))
    acting = (*neo_hooke(0.01, 10.0), passive)
    body = Body(mesh, acting, (*clamped("z0"), turned), (0.0, 1.0), Along((0.0, 0.0, 1.0)))
    settings: dict[str, Any] = {"linear_solver": solver, "precision": precision, "residual": residual}
    return lab.solve(body, "P2/P1", first_step=0.25, **settings).last.points


def difference(lab: Lab, solver: str, precision: str | None = None, residual: float = RESIDUAL) -> float:
    """The largest distance of a node from where it is by the direct solver in double precision [mm]."""
    return farthest(solved(lab, "direct", "double", RESIDUAL), solved(lab, solver, precision, residual))


LAGGED = Entry(
    name="lagged_factorisation",
    group="linear solvers",
    title="Turned bar of muscle by lagged factorisations in double precision and by direct ones: largest difference of a node",
    unit="mm",
    measure=difference,
    given={"solver": "lagged", "precision": "double"},
    **control("Newton's method ends at a residual of 1e-2 N.", residual=1e-2),
    truth=0.0,
    within=1e-9,
    because="Both end where the residual is below 1e-11 N, far below it as a rule; where the bar is softest (some 0.006 N/mm) that "
    "would leave 2e-9 mm.",
    kind="property",
    source="The solution of an equation does not depend on how it was found.",
)

ENTRIES = (
    LAGGED,
    replace(
        LAGGED,
        name="lagged_factorisation_single",
        title="Turned bar of muscle by lagged factorisations in single precision and by direct ones in double: largest difference "
        "of a node",
        given={"solver": "lagged", "precision": "single"},
    ),
    replace(
        LAGGED,
        name="multigrid",
        title="Turned bar of muscle by multigrid between P2 and P1 and by direct factorisations: largest difference of a node",
        within=1e-8,
        given={"solver": "multigrid"},
    ),
)
