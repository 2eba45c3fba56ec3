"""FEniCSx and scikit-fem on the same bodies, and the linear solvers of FEniCSx, which must not change the solution.

FEniCSx and scikit-fem share no assembly, no derivatives and no linear algebra. Their discretisations are the same. Their states
differ by Newton's residual and, where quadrature is not exact, because of different rules: both solvers use Gauss-Legendre points
in hexahedra, but different points in tetrahedra, where the difference vanishes as the degree of the rules increases.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from fem_reference.assessment.catalogue import Entry, Finding, Lab
from fem_reference.effects import Effect, make
from fem_reference.foundations.mesh import Floats
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Cells, Prescribed
from fem_reference.problems.paths import Affine, Along, Rest, Turn
from fem_reference.runs.store import Frame
from fem_reference.verification import fibres, parts
from fem_reference.verification.cook import Panel
from fem_reference.verification.homogeneous import HEART, MOONEY, MU, NEO, Specimen
from fem_reference.verification.loads import dead
from fem_reference.verification.patch import patch


def stiffer(body: Body, error: float) -> Body:
    """``body`` with a relative ``error`` in the first parameter of its first effect, a modulus."""
    first, *others = body.effects
    name, value, _ = first.parameters[0]
    return replace(body, effects=(first.model_copy(update={name: value * (1 + error)}), *others))


def agreement(
    lab: Lab, body: Callable[[], Body], element: str, residual: float, quadrature: int | None, error: float = 0.0
) -> Finding:
    """The largest of the relative differences that :func:`differences` returns.

    ``residual`` [N, mm3]; ``quadrature``: the degree of both rules, or None for the defaults; ``error``: the relative error of the
    modulus in scikit-fem.
    """
    settings: dict[str, float] = {"first_step": 0.5, "residual": residual}
    if quadrature is not None:
        settings["quadrature_degree"] = quadrature
    made = body()
    first = lab.solve(made, element, **settings).last
    second = lab.second(stiffer(made, error), element, **settings).last
    found = differences(first, second, made.mesh.points)
    note = ", ".join(f"{name} {value:.1e}" for name, value in found.items())
    return Finding(max(found.values()), note=f"{note}; {first.scalars['newton_iterations']:.0f} Newton iterations")


def differences(first: Frame, second: Frame, rest: Floats) -> dict[str, float]:
    """The relative differences between two states of a body: in node positions, relative to the largest displacement from ``rest``
    (n, 3) [mm]; in the energy; and in forces and moments, relative to the largest component.
    """
    return {
        "positions": parts.farthest(second.points, first.points) / parts.farthest(first.points, rest),
        "energy": abs(second.scalars["energy"] / first.scalars["energy"] - 1),
        "forces": _difference(first.forces, second.forces),
        "moments": _difference(first.moments, second.moments),
    }


def _difference(first: dict[str, Floats], second: dict[str, Floats]) -> float:
    ours, theirs = (np.stack([one[name] for name in first]) for one in (first, second))
    return float(np.abs(theirs - ours).max() / np.abs(ours).max())


def built(
    acting: tuple[Effect, ...], mesh: Callable[..., Cells], prescribed: tuple[Prescribed, ...], element: str
) -> Body:
    """A body with the ``acting`` effects and a resistance to volume change; ``mesh`` creates cells of the kind of ``element``."""
    acting = (*acting, parts.resistance(element, 1.0))
    return Body(mesh(kind=ELEMENTS[element][0]), acting, prescribed, (0.0, 1.0), Along((2 / 7, 3 / 7, 6 / 7)))


# Newton's method ends at this residual [N, mm3]. The softest mode of the bar has a stiffness of about mu w^4 / l^3 = 0.006 N/mm.
RESIDUAL = 1e-11


def turned_bar(lab: Lab, solver: str, precision: str | None, residual: float) -> Floats:
    """The deformed nodes (n, 3) [mm] of a bar of muscle, one end clamped and the other turned by 1 rad about an oblique axis."""
    mesh = shapes.box((3, 3, 7), (10.0, 10.0, 25.0), "tetrahedron")
    passive = make("fibre_passive", stress="300 kPa", p1=0.05, p2=6.6, optimal_stretch=1.0, linear_from=1.4)
    turned = Prescribed("z1", "z1", (0, 1, 2), Turn((1.0, 0.0, 2.0), 1.0, (5.0, 5.0, 12.5)))
    acting = (*parts.neo_hooke(0.01, 10.0), passive)
    body = Body(mesh, acting, (*parts.clamped("z0"), turned), (0.0, 1.0), Along((0.0, 0.0, 1.0)))
    settings: dict[str, Any] = {"linear_solver": solver, "precision": precision, "residual": residual}
    return lab.solve(body, "P2/P1", first_step=0.25, **settings).last.points


def difference(lab: Lab, solver: str, precision: str | None = None, residual: float = RESIDUAL) -> float:
    """The largest distance [mm] of a node from its position as computed by the direct solver in double precision."""
    return parts.farthest(turned_bar(lab, "direct", "double", RESIDUAL), turned_bar(lab, solver, precision, residual))


NEO_HOOKE = make("neo_hooke", mu="10 kPa")
MOONEY_RIVLIN = make("mooney_rivlin", c1="3 kPa", c2="2 kPa")
GUCCIONE = make("guccione", c="2 kPa", bf=8.0, bt=2.0, bfs=4.0)
HOLZAPFEL_OGDEN = make("holzapfel_ogden", k1="5 kPa", k2=1.0, angle="30 deg", normal=[1.0, 0.0, 0.0])
PASSIVE = make("fibre_passive", stress="300 kPa", p1=0.05, p2=6.6, optimal_stretch=1.0, linear_from=1.4)
ACTIVE = make("fibre_active", stress="20 kPa", optimal_stretch=1.0, ramp=parts.ramp())
FEBIO = make("fibre_passive_febio", c3="5 kPa", c4=5.0, c5="300 kPa", linear_from=1.3)
TENSION = make("active_tension", tension="5 kPa", ramp=parts.ramp())
PRESTRETCH = make("prestretch", stretch=1.1, ramp=parts.ramp())
WEIGHT = make("gravity", density="1060 kg/m3", acceleration="9.81, 0, -500 m/s^2", ramp=parts.ramp())
FLUID = make("pressure", on="x1", pressure="1 kPa", ramp=parts.ramp())

BAR = partial(shapes.box, (2, 2, 4), (1.0, 1.0, 2.0))
SHORT_BAR = partial(shapes.box, (1, 1, 2), (1.0, 1.0, 2.0))
BLOCK = partial(shapes.warped_box, (2, 2, 2), (1.0, 1.0, 1.0))
CURVED_BLOCK = partial(BLOCK, degree=2)
# The axis lies between the bar's own axis, z, and a direction across the bar, so that the turn bends and twists the bar.
TURNED = (*parts.clamped("z0"), Prescribed("z1", "z1", (0, 1, 2), Turn((1.0, 0.0, 2.0), 0.5, (0.5, 0.5, 2.0))))
STANDING = (*parts.clamped("z0"), Prescribed("y0", "y0", (1,), Rest(), stiffness=0.01))
PULLED = (*parts.SYMMETRY, Prescribed("z1", "z1", (2,), Affine(parts.NO_GRADIENT, (0.0, 0.0, 0.6))))

REMAINS = "Newton's residual of 1e-14 N, at forces of about 1e-3 N, and rounding remain"
ALIKE = "both integrate by the same Gauss-Legendre rule, so that only"
SAME_RULE = f"{ALIKE} {REMAINS}"
CONSTANT = f"F is constant in a cell, so that every rule is exact: {REMAINS}"
BAR_RULES = (
    "the solvers use different quadrature rules, here of degree 9; with P2/P1 the results for this bar differ by 3e-6 at "
    "degree 4, 3e-7 at 6, 1e-9 at 8 and 2e-11 at 9"
)
BLOCK_RULES = (
    "the solvers use different quadrature rules, here of degree 9; the results for this block differ by 4e-6 at degree 4, "
    "1e-11 at 8 and 4e-14 at 9"
)


class Tolerance(NamedTuple):
    """The tolerance of an entry and its reason; ``residual`` [N, mm3]; ``quadrature``: a degree, None for each solver's default."""

    within: float
    because: str
    residual: float = 1e-13
    quadrature: int | None = None


TOLERANCES = {
    "P1": Tolerance(1e-11, CONSTANT, 1e-14, 2),
    "P1/P1": Tolerance(1e-11, CONSTANT, 1e-14, 2),
    "P2": Tolerance(1e-11, BLOCK_RULES, 1e-14, 9),
    "P2/P0": Tolerance(1e-9, BAR_RULES, 1e-14, 9),
    "P2/P1": Tolerance(1e-10, BAR_RULES, 1e-14, 9),
    "Q1": Tolerance(1e-11, SAME_RULE, 1e-14, 3),
    "Q1/P0": Tolerance(1e-11, SAME_RULE, 1e-14, 3),
    "Q2": Tolerance(1e-11, SAME_RULE, 1e-14, 5),
    "Q2/Q1": Tolerance(1e-11, SAME_RULE, 1e-14, 5),
}
STEEPER = Tolerance(
    1e-10,
    "F is constant, so that every rule is exact: Newton's residual of 1e-13 N, at forces of 0.01 to 3 N, and rounding remain",
)
BENT = "bent and twisted at once"
LEANING = "under its weight and a fluid pressure on one side, supported by springs"
BY_GAUSS = Tolerance(1e-9, f"{ALIKE} Newton's residual of 1e-8 N, at forces of 50 N, remains", 1e-8, 5)


def opinion(name: str, title: str, body: Callable[[], Body], element: str, tolerance: Tolerance) -> Entry:
    """The entry for a body that both solvers solve."""
    return Entry(
        name=f"second_opinion_{name}",
        group="second opinion",
        title=f"{title}, with {element}: largest relative difference between FEniCSx and scikit-fem",
        unit="1",
        measure=agreement,
        given={"body": body, "element": element, "residual": tolerance.residual, "quadrature": tolerance.quadrature},
        **parts.control("in scikit-fem the first modulus is 1 % too large", error=0.01),
        truth=0.0,
        within=tolerance.within,
        because=tolerance.because,
        kind="second solver",
        source="elements of scikit-fem; derivatives by jets, our own assembly and Newton's method, scipy's sparse LU",
    )


def specimen(name: str, words: str, block: Specimen) -> Entry:
    """The entry for a block of the groups homogeneous, fibres or loads; ``words`` follow "A block" in its title."""
    return opinion(name, f"A block {words}", block.body, block.element, STEEPER)


ACTIVE_BLOCK = Specimen(NEO + fibres.active(0.1), "P2/P1", "pulled", MU, loads=(dead(MU),))
FAMILIES = Specimen(fibres.FAMILIES, "P2/P1", "equibiaxial", 1.25)
SHORTENED, SHEARED = Specimen(MOONEY, "Q1/P0", "planar", 0.7), Specimen(HEART, "P2/P1", "simple_shear", 0.3)
MUSCLE, LOADED = (NEO_HOOKE, PASSIVE, ACTIVE), (NEO_HOOKE, WEIGHT, FLUID)
TAUT = (NEO_HOOKE, FEBIO, TENSION, PRESTRETCH)
BENT_P1 = f"A neo-Hookean bar with a penalty on its volume, {BENT}"
BENT_P1P1 = f"A bar of muscle whose linear pressure is stabilised, {BENT}"
BENT_GUCCIONE = f"A bar of Guccione's heart muscle with a penalty on its volume, {BENT}"
BENT_FAMILIES = f"A bar with two families of fibres and a penalty on its volume, {BENT}"
BENT_TAUT = f"A bar with FEBio's fibres, which are prestretched and contract, {BENT}"
PULLED_BLOCK = partial(built, (MOONEY_RIVLIN,), SHORT_BAR, PULLED, "P2/P1")
PATCH = "A patch of curved cells that is stretched, sheared and turned at once"
COOK = "Cook's membrane in 4 by 4 cells at a quarter of the load"
EXTENDED = "A block of Mooney-Rivlin material pulled to 1.3 times its length"

LAGGED = Entry(
    name="lagged_factorisation",
    group="linear solvers",
    title="Turned bar of muscle: largest difference of a nodal position between lagged factorisations, in double precision, and "
    "direct ones",
    unit="mm",
    measure=difference,
    given={"solver": "lagged", "precision": "double"},
    **parts.control("Newton's method ends at a residual of 1e-2 N.", residual=1e-2),
    truth=0.0,
    within=1e-9,
    because="Both end at a residual below 1e-11 N, usually far below; in the softest mode of the bar (about 0.006 N/mm) 1e-11 N "
    "is an error of 2e-9 mm.",
    kind="property",
    source="The solution of the equations does not depend on the linear solver.",
)

ENTRIES: tuple[Entry, ...] = (
    specimen("uniaxial", "with passive fibres, stretched along them", fibres.muscle(fibres.passive(), 1.6)),
    specimen("equibiaxial", "with two families of fibres, stretched equally along two axes", FAMILIES),
    specimen("planar", "of Mooney-Rivlin material, shortened with its width fixed", SHORTENED),
    specimen("simple_shear", "of Guccione's heart muscle in simple shear", SHEARED),
    specimen("pulled", "with active fibres, pulled by a dead load", ACTIVE_BLOCK),
    specimen("febio", "with FEBio's fibres, stretched along them", fibres.muscle(fibres.passive_febio(), 1.6)),
    specimen("tension", "with fibres of constant tension, shortened to 0.9", fibres.muscle(fibres.tension(), 0.9)),
    specimen("taut", "of prestretched muscle, fixed at its length", Specimen(fibres.TAUT, "P2/P1", "uniaxial", 1.0)),
    specimen("neo_hooke", "of neo-Hookean material, stretched along one axis", Specimen(NEO, "P1", "uniaxial", 1.6)),
    opinion("patch", PATCH, partial(patch, "Q2/Q1", 2), "Q2/Q1", STEEPER),
    opinion("cook", COOK, partial(Panel("FINITE_QUARTER", "Q2/Q1").body, 4), "Q2/Q1", BY_GAUSS),
    opinion("homogeneous", EXTENDED, PULLED_BLOCK, "P2/P1", Tolerance(1e-11, CONSTANT, 1e-14, 4)),
    *(
        opinion(name, title, partial(built, acting, mesh, prescribed, element), element, TOLERANCES[element])
        for name, title, acting, mesh, prescribed, element in (
            ("bar_p2p1", f"A neo-Hookean bar {BENT}", (NEO_HOOKE,), BAR, TURNED, "P2/P1"),
            ("bar_q1p0", f"A neo-Hookean bar {BENT}", (NEO_HOOKE,), BAR, TURNED, "Q1/P0"),
            ("bar_p1", BENT_P1, (NEO_HOOKE,), BAR, TURNED, "P1"),
            ("bar_p1p1", BENT_P1P1, (NEO_HOOKE, PASSIVE), BAR, TURNED, "P1/P1"),
            ("mooney_rivlin", f"A Mooney-Rivlin bar {BENT}", (MOONEY_RIVLIN,), BAR, TURNED, "P2/P0"),
            ("fibres", f"A bar of muscle, fibres passive and active, {BENT}", MUSCLE, BAR, TURNED, "Q1/P0"),
            ("prestretch", BENT_TAUT, TAUT, BAR, TURNED, "Q1/P0"),
            ("guccione", BENT_GUCCIONE, (GUCCIONE,), SHORT_BAR, TURNED, "Q2"),
            ("holzapfel_ogden", BENT_FAMILIES, (HOLZAPFEL_OGDEN, NEO_HOOKE), BAR, TURNED, "Q1"),
            ("loads", f"A block of curved cells {LEANING}", LOADED, CURVED_BLOCK, STANDING, "Q2/Q1"),
            ("loads_p2", f"A block {LEANING}", LOADED, BLOCK, STANDING, "P2"),
        )
    ),
    LAGGED,
    replace(
        LAGGED,
        name="lagged_factorisation_single",
        title="Turned bar of muscle: largest difference of a nodal position between lagged factorisations, in single precision, "
        "and direct ones in double precision",
        given={"solver": "lagged", "precision": "single"},
    ),
    replace(
        LAGGED,
        name="multigrid",
        title="Turned bar of muscle: largest difference of a nodal position between multigrid (P2 and P1) and direct "
        "factorisations",
        within=1e-8,
        given={"solver": "multigrid"},
    ),
)
