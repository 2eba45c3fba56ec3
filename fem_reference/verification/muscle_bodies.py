"""Idealised muscles compared with measurements: a vastus lateralis with its aponeurosis, and a tibialis anterior under a sphere.

The material is the shipped one, which was chosen from other sources and never fitted to these measurements. The shapes are
idealised and their sizes are recalled or assumed, so no entry validates the model. The published measurements are in
``validation/experiments``.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from scipy.spatial import cKDTree

from fem_reference.assessment.catalogue import Entry, Lab, Refinement
from fem_reference.assessment.experiments import find, ratio
from fem_reference.assessment.muscle_cubes import FIBRES
from fem_reference.effects import Effect, Energy, Moduli, State, make
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.units import PositivePressure
from fem_reference.geometry.regions import Blended
from fem_reference.geometry.rigid_bodies import Sphere
from fem_reference.problems.body import Body, ByCell, Prescribed
from fem_reference.problems.contact import ContactBone, ContactLaw
from fem_reference.problems.paths import Affine, Rest
from fem_reference.problems.shapes import Brick, mapped
from fem_reference.verification.contact import sliding_by
from fem_reference.verification.experiments import EXPERIMENT
from fem_reference.verification.parts import NO_GRADIENT, SLOW, clamped, control, sliding

ELEMENT = "Q2/Q1"
# Vastus lateralis: Ward et al. 2009, doi 10.1007/s11999-008-0594-8, and moment arms of the knee extensors, all recalled.
FIBRE, OPTIMAL, PENNATION, ARM = 99.4, 2.7, math.radians(18.4), 40.0  # [mm] at a sarcomere length [um], [rad], [mm]
APONEUROSIS, HALF_WIDTH, THIN = 174.0, 32.5, 1.0  # length, half the width and thickness of the aponeurosis [mm]
FLEXION = math.radians(110 - 50)
LENGTH = FIBRE * find("chen_2016", "sarcomere_length", "50 deg").value / OPTIMAL  # of the fibres at 50 degrees [mm]
ALONG, THICK = LENGTH * math.cos(PENNATION), LENGTH * math.sin(PENNATION)
# Tendon after Blemker, Pinsky and Delp 2005, recalled: 2.7 MPa (exp(46.4 (stretch - 1)) - 1) up to a stretch of 1.03, then linear.
L1, L2, STRAIGHT = 2.7, 46.4, 1.03
# Tibialis anterior of a rat: half its length and width, thickness, and the radius of the sphere [mm]; assumed.
TIBIALIS, BALL = (12.0, 5.0, 6.0), 3.0
MU = 0.01  # shear modulus of the shipped matrix [MPa]
_MU, _ALPHA = find("bosboom_2001", "ogden_mu", ""), find("bosboom_2001", "ogden_alpha", "")


@dataclass(frozen=True)
class Above:
    """The height [mm] above the upper face of the muscle. The aponeurosis lies above this face."""

    def __call__(self, points: Floats) -> Floats:
        """The heights (n,) of points (n, 3) [mm]."""
        return np.asarray(points[:, 1] - THICK)


def vastus(n: int, arm: float) -> Body:
    """Half of a planar muscle whose fibres rise from the bone to an aponeurosis. The end of the aponeurosis is displaced by the
    moment arm ``arm`` [mm] times the knee flexion. The aponeurosis slides below a fascia, which keeps the thickness constant.
    """
    counts, size = (6 * n, 2 * n, 2 * n), (APONEUROSIS, THICK, HALF_WIDTH)
    rising = Brick(lambda u: u * size + u[:, 1:2] * (ALONG, 0, 0), counts, {"y0": "bone", "z0": "middle"})
    faces = {"x1": "end", "y1": "fascia", "z0": "middle"}
    sheet = Brick(lambda u: u * (size[0], THIN, size[2]) + (ALONG, THICK, 0), (counts[0], 1, counts[2]), faces)
    mesh = mapped([rising, sheet], "hexahedron", 1)
    pulled = Prescribed("end", "end", (0,), Affine(NO_GRADIENT, (arm * FLEXION, 0.0, 0.0)))
    planes = *clamped("middle", components=(2,)), *clamped("fascia", components=(1,))
    tendon, rest = {"in": "tendon"}, {"in": "not tendon"}
    slope = L1 * L2 * math.exp(L2 * (STRAIGHT - 1))
    laws = (
        *(make("neo_hooke", mu=f"{mu} MPa", **on) for mu, on in ((MU, rest), (100 * MU, tendon))),
        *(make("incompressible", bulk=f"{bulk} MPa", **on) for bulk, on in ((10.0, rest), (1000.0, tendon))),
        make("fibre_passive", **FIBRES, **rest),
        make("fibre_passive_febio", c3=f"{L1} MPa", c4=L2, c5=f"{slope} MPa", linear_from=STRAIGHT, **tendon),
    )
    above = Above()(mesh.points[mesh.cells].mean(axis=1)) > 0
    fibre = ByCell(np.where(above[:, None], (1.0, 0.0, 0.0), (math.cos(PENNATION), math.sin(PENNATION), 0.0)))
    fixed = Prescribed("bone", "bone", (0, 1, 2), Rest()), pulled, *planes
    return Body(mesh, laws, fixed, (0.0, 1.0), fibre, regions={"tendon": Blended(Above(), 0.0)})


def vastus_stretch(lab: Lab, n: int, arm: float) -> float:
    """The mean stretch of the straight lines between the ends of the fibres, on bone and aponeurosis."""
    body = vastus(n, arm)
    now = lab.solve(body, ELEMENT, first_step=0.25 / n, residual=1e-8).last.points
    low = np.unique(body.mesh.facets["bone"])
    high = cKDTree(body.mesh.points).query(body.mesh.points[low] + (ALONG, THICK, 0))[1]
    return float(np.linalg.norm(now[high] - now[low], axis=1).mean() / LENGTH)


class FittedOgden(Energy):
    """The law ``2 mu/a^2 (l1^a + l2^a + l3^a - 3)`` of the isochoric principal stretches (Ogden 1972), with the exponent a = 22.

    This is the even exponent nearest to the 21.4 that Bosboom et al. 2001 fitted. A sum of even powers is a polynomial in the
    invariants (Newton's identities), which is smooth at rest. ``mu``: shear modulus at rest [MPa].
    """

    half: ClassVar[int] = 11
    mu: PositivePressure

    def moduli(self) -> Moduli:
        """The elastic moduli of this law at rest."""
        return Moduli(shear=self.mu)

    def energy(self, state: State) -> Any:
        """Energy per unit rest volume [MPa]."""
        first, second = state.J ** (-2 / 3) * state.I1, state.J ** (-4 / 3) * state.I2
        sums = [3.0, first, first**2 - 2 * second]
        for _ in range(self.half - 2):
            sums.append(first * sums[-1] - second * sums[-2] + sums[-3])
        return self.mu / (2 * self.half**2) * (sums[-1] - 3)


def ball_force(lab: Lab, n: int, depth: float, laws: tuple[Effect, ...]) -> float:
    """The force [N] of a smooth sphere that is pressed to a ``depth`` [mm] into a muscle on a bone, across the fibres."""

    def place(u: Floats) -> Floats:
        finer = np.column_stack([u[:, 0] ** 1.4, u[:, 1] ** 1.4, 1 - (1 - u[:, 2]) ** 1.2])
        return np.asarray(finer * TIBIALIS)

    faces = {face: face for face in ("x0", "y0", "z0", "z1")}
    mesh = mapped([Brick(place, (4 * n, 3 * n, 2 * n), faces)], "hexahedron", 1)
    ball = ContactBone("ball", Sphere((0.0, 0.0, TIBIALIS[2] + BALL), BALL), sliding_by(-depth))
    body = Body(
        mesh,
        (*laws, make("incompressible", bulk="10 MPa")),
        (*sliding("x0", "y0"), *clamped("z0")),
        (0.0, 1.0),
        ByCell(np.tile([1.0, 0.0, 0.0], (len(mesh.cells), 1))),
        ContactLaw("z1", stiffness=20.0, smoothing=0.01),
        (ball,),
    )
    state = lab.solve(body, ELEMENT, first_step=0.125 / n, residual=1e-9, newton_iterations=25).last
    return -4 * float(state.forces["ball"][2])


def indentation(lab: Lab, n: int, depth: float, mu: float) -> float:
    """The force on the shipped material with the shear modulus ``mu`` [MPa], divided by the force on the fitted law."""
    shipped = make("neo_hooke", mu=f"{mu} MPa"), make("fibre_passive", **FIBRES)
    fitted = (FittedOgden.model_validate({"mu": f"{_MU.value} kPa"}),)
    return ball_force(lab, n, depth, shipped) / ball_force(lab, n, depth, fitted)


# For each depth [mm]: half the difference of the forces at exponents 16 and 28 (reported SD: 5.7), divided by the force at 22.
_BY_EXPONENT = {0.6: 0.071, 1.2: 0.271}
_SARCOMERES = find("chen_2016", "sarcomere_length", "110 deg"), find("chen_2016", "sarcomere_length", "50 deg")
_STRETCH, _SD = ratio(*_SARCOMERES)
_FINER = "The finer mesh is solved in twice as many load steps."
_OTHER_MU = (
    f"The abstract does not define mu. If the shear modulus is mu alpha / 2, {_MU.value * _ALPHA.value / 2:.0f} kPa, the ratio is "
    f"smaller by a factor of {_ALPHA.value / 2:.1f}."
)


def _indented(name: str, share: str, depth: float, pinned: float) -> Entry:
    """The entry for an indentation to a ``depth`` [mm]; ``share``: this depth as a fraction of the thickness, in words."""
    spread = (_MU.sd or math.nan) / _MU.value
    return EXPERIMENT(
        name=name,
        title=f"Sphere pressed across the fibres into an idealised tibialis anterior, by a {share} of its thickness: force "
        "divided by that of a law fitted to indentations",
        unit="1",
        measure=indentation,
        given={"depth": depth, "mu": MU},
        **control("Shear modulus 10 % too high.", mu=1.1 * MU),
        truth=1.0,
        within=math.hypot(spread, _BY_EXPONENT[depth]),
        because=f"Standard deviations of mu, {100 * spread:.0f} %, and of the exponent, {100 * _BY_EXPONENT[depth]:.0f} % of the "
        "force at this depth, taken as independent.",
        source="bosboom_2001, read in: abstract; doi 10.1016/S0021-9290(01)00083-5; shape, sphere and depth assumed; mu read as "
        "the shear modulus, recalled",
        refinement=Refinement((1, 2), TIBIALIS[0] / 4, None, note=f"{_FINER} {_OTHER_MU}"),
        pinned=pinned,
        facts=(_MU, _ALPHA),
        from_memory=True,
        **SLOW,
    )


ENTRIES = (
    EXPERIMENT(
        name="vastus_stretch",
        title="Idealised vastus lateralis with aponeurosis, knee flexed from 50 to 110 degrees: stretch of its fibres",
        unit="1",
        measure=vastus_stretch,
        given={"arm": ARM},
        **control("Moment arm 10 % too large.", arm=1.1 * ARM),
        truth=_STRETCH,
        within=_SD,
        because="The standard deviation of the ratio of two mean sarcomere lengths of six people, taken as independent.",
        source="chen_2016, read in: abstract; doi 10.1016/j.jbiomech.2016.07.013; architecture, moment arm and tendon recalled",
        refinement=Refinement(
            (1, 2), APONEUROSIS / 6, None, note=f"{_FINER} The tendon beyond the muscle is rigid here."
        ),
        pinned=1.3606991,
        facts=_SARCOMERES,
        from_memory=True,
        **SLOW,
    ),
    _indented("indentation_tenth", "tenth", 0.6, 0.7671037),
    _indented("indentation_fifth", "fifth", 1.2, 0.5385168),
)
