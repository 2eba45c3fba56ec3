"""The same bodies by two solvers that share no assembly, no derivatives and no linear algebra: FEniCSx and scikit-fem.

Both discretise alike, so that their states differ by Newton's residual and, where a rule cannot integrate an energy exactly, by
their rules: Gauss-Legendre in hexahedra for both, but other points in tetrahedra, where a higher degree brings them together.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from fem_reference.assessment.catalogue import Entry, Finding, Lab
from fem_reference.effects import make
from fem_reference.foundations.mesh import Floats
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Cells, Prescribed
from fem_reference.problems.paths import Affine, Along, Rest, Turn
from fem_reference.runs.solved import Reached
from fem_reference.verification import fibres
from fem_reference.verification.cook import Panel
from fem_reference.verification.homogeneous import HEART, MOONEY, MU, NEO, Specimen
from fem_reference.verification.loads import dead
from fem_reference.verification.parts import ramp, zero
from fem_reference.verification.patch import Patch

RESIDUAL = 1e-14  # [N, mm3]
FIBRE = Along((2 / 7, 3 / 7, 6 / 7))
# Bends and twists at once: an axis between that of the bar, z, and one across it.
TURN = Turn((1.0, 0.0, 2.0), 0.5, (0.5, 0.5, 2.0))
RAMP = ramp()
MIXED = ("incompressible", {"bulk": "1 MPa"})
PENALTY = ("incompressible_penalty", {"bulk": "1 MPa"})
NEO_HOOKE = ("neo_hooke", {"mu": "10 kPa"})
MOONEY_RIVLIN = ("mooney_rivlin", {"c1": "3 kPa", "c2": "2 kPa"})
GUCCIONE = ("guccione", {"c": "2 kPa", "bf": 8.0, "bt": 2.0, "bfs": 4.0})
HOLZAPFEL_OGDEN = ("holzapfel_ogden", {"k1": "5 kPa", "k2": 1.0, "angle": "30 deg", "normal": [1.0, 0.0, 0.0]})
PASSIVE = (
    "fibre_passive",
    {"stress": "300 kPa", "p1": 0.05, "p2": 6.6, "optimal_stretch": 1.0, "linear_from": 1.4},
)
ACTIVE = ("fibre_active", {"stress": "20 kPa", "optimal_stretch": 1.0, "ramp": RAMP})
FEBIO = ("fibre_passive_febio", {"c3": "5 kPa", "c4": 5.0, "c5": "300 kPa", "linear_from": 1.3})
TENSION = ("active_tension", {"tension": "5 kPa", "ramp": RAMP})
PRESTRETCH = ("prestretch", {"stretch": 1.1, "ramp": RAMP})
WEIGHT = ("gravity", {"density": "1060 kg/m3", "acceleration": "9.81, 0, -500 m/s^2", "ramp": RAMP})
FLUID = ("pressure", {"on": "x1", "pressure": "1 kPa", "ramp": RAMP})

Named = tuple[str, dict[str, Any]]  # an effect and its parameters as scene files write them


@dataclass(frozen=True, eq=False)
class Sample:
    """A body to be solved twice: what acts, the mesh by kind of its cells, what is prescribed, and the element with the
    ``quadrature`` degree of both.
    """

    acting: tuple[Named, ...]
    mesh: Callable[..., Cells]
    prescribed: tuple[Prescribed, ...]
    element: str
    quadrature: int
    residual = RESIDUAL

    def body(self) -> Body:
        """The body."""
        acting = tuple(make(name, **parameters) for name, parameters in self.acting)
        return Body(self.mesh(kind=ELEMENTS[self.element][0]), acting, self.prescribed, (0.0, 1.0), FIBRE)


@dataclass(frozen=True, eq=False)
class Borrowed:
    """The ``body`` of an entry of another group, to be solved twice too; ``residual`` [N, mm3], without a ``quadrature`` degree
    that of each solver.
    """

    body: Callable[[], Body]
    element: str
    quadrature: int | None = None
    residual: float = 1e-13


BAR = partial(shapes.box, (2, 2, 4), (1.0, 1.0, 2.0))
SHORT_BAR = partial(shapes.box, (1, 1, 2), (1.0, 1.0, 2.0))
BLOCK = partial(shapes.warped_box, (2, 2, 2), (1.0, 1.0, 1.0))
CURVED_BLOCK = partial(BLOCK, degree=2)
TURNED = (Prescribed("bottom", "z0", (0, 1, 2), Rest()), Prescribed("top", "z1", (0, 1, 2), TURN))
SPRINGS = Prescribed("springs", "y0", (1,), Rest(), stiffness=0.01)
STANDING = (Prescribed("ground", "z0", (0, 1, 2), Rest()), SPRINGS)
PULLED = (
    *(Prescribed(face, face, (axis,), Rest()) for axis, face in enumerate(("x0", "y0", "z0"))),
    Prescribed("top", "z1", (2,), Affine(((0.0, 0.0, 0.0),) * 3, (0.0, 0.0, 0.6))),
)


def stiffer(body: Body, error: float) -> Body:
    """``body`` with an ``error`` of the first parameter of its first effect, a modulus, relative."""
    first, *others = body.effects
    name, value, _ = first.parameters[0]
    return replace(body, effects=(first.model_copy(update={name: value * (1 + error)}), *others))


def agreement(lab: Lab, sample: Sample | Borrowed, error: float = 0.0) -> Finding:
    """The largest of the relative differences of :func:`differences`; ``error``: of a modulus of the second."""
    settings: dict[str, float] = {"first_step": 0.5, "residual": sample.residual}
    if sample.quadrature is not None:
        settings["quadrature_degree"] = sample.quadrature
    body = sample.body()
    first = lab.solve(body, sample.element, **settings).last
    second = lab.second(stiffer(body, error), sample.element, **settings).last
    found = differences(first, second, body.mesh.points)
    note = ", ".join(f"{name} {value:.1e}" for name, value in found.items())
    return Finding(max(found.values()), note=f"{note}; {first.scalars['newton_iterations']:.0f} Newton iterations")


def differences(first: Reached, second: Reached, rest: Floats) -> dict[str, float]:
    """Between two states of a body: of node positions over the greatest displacement from ``rest`` (n, 3), and relative ones of
    energies, and of forces and moments over their greatest.
    """
    moved = np.linalg.norm(first.points - rest, axis=1).max()
    off = np.linalg.norm(second.points - first.points, axis=1).max()
    energies = [state.scalars["energy"] for state in (first, second)]
    return {
        "positions": float(off / moved),
        "energy": abs(energies[1] / energies[0] - 1),
        "forces": _difference(first.forces, second.forces),
        "moments": _difference(first.moments, second.moments),
    }


def _difference(first: dict[str, Floats], second: dict[str, Floats]) -> float:
    ours, theirs = (np.stack([one[name] for name in first]) for one in (first, second))
    return float(np.abs(theirs - ours).max() / np.abs(ours).max())


def _entry(name: str, title: str, sample: Sample | Borrowed, within: float, because: str) -> Entry:
    return Entry(
        name=f"second_opinion_{name}",
        group="second opinion",
        title=f"{title} by {sample.element}: how far FEniCSx and scikit-fem differ",
        unit="1",
        truth=zero,
        within=within,
        relative=False,
        because=because,
        kind="second solver",
        source="scikit-fem's elements; derivatives by jets, own assembly and Newton's method, scipy's sparse LU",
        measure=partial(agreement, sample=sample),
        negative_control="in scikit-fem the first modulus is 1 % too large",
        with_negative_control=partial(agreement, sample=sample, error=0.01),
    )


_REMAINS = "Newton's residual of 1e-14 N, at forces of about 1e-3 N, and rounding remain"
_SAME_RULE = f"both integrate by the same Gauss-Legendre rule, so that {_REMAINS}"
_CONSTANT = f"F is constant in a cell, so that every rule is exact: {_REMAINS}"
_BAR_RULES = (
    "they integrate by different rules, here of degree 9; by P2/P1 this bar differs by 3e-6 with those of degree 4, 3e-7 with 6, "
    "1e-9 with 8 and 2e-11 with 9"
)
_BLOCK_RULES = (
    "they integrate by different rules, here of degree 9; this block differs by 4e-6 with those of degree 4, 1e-11 with 8 and "
    "4e-14 with 9"
)

_STEEPER = "F is constant, so that every rule is exact: Newton's residual of 1e-13 N, at forces of 0.01 to 3 N, and rounding remain"


def _specimen(name: str, words: str, specimen: Specimen) -> Entry:
    """Of the groups homogeneous, fibres and loads; ``words`` after "A block"."""
    return _entry(name, f"A block {words},", Borrowed(specimen.body, specimen.element), 1e-10, _STEEPER)


_SPECIMENS = {
    "uniaxial": (
        "with passive fibres, stretched along them",
        Specimen(NEO + fibres.passive(), "P2/P1", "uniaxial", 1.6),
    ),
    "equibiaxial": (
        "with two families of fibres, stretched alike along two axes",
        Specimen(NEO + fibres.two_families(30.0), "P2/P1", "equibiaxial", 1.25),
    ),
    "planar": ("of Mooney-Rivlin material, shortened with its width fixed", Specimen(MOONEY, "Q1/P0", "planar", 0.7)),
    "simple_shear": ("of Guccione's heart muscle in simple shear", Specimen(HEART, "P2/P1", "simple_shear", 0.3)),
    "pulled": (
        "with active fibres, pulled by a dead force",
        Specimen(NEO + fibres.active(0.1), "P2/P1", "pulled", MU, loads=(dead(MU),)),
    ),
    "febio": (
        "with FEBio's fibres, stretched along them",
        Specimen(NEO + fibres.passive_febio(), "P2/P1", "uniaxial", 1.6),
    ),
    "tension": (
        "with fibres of constant tension, fixed short",
        Specimen(NEO + fibres.tension(), "P2/P1", "uniaxial", 0.9),
    ),
    "taut": (
        "of prestretched muscle, fixed",
        Specimen(fibres.taut(NEO + fibres.passive(), 1.2), "P2/P1", "uniaxial", 1.0),
    ),
    "neo_hooke": ("of neo-Hookean material, stretched along one axis", Specimen(NEO, "P1", "uniaxial", 1.6)),
}

ENTRIES = (
    *(_specimen(name, words, specimen) for name, (words, specimen) in _SPECIMENS.items()),
    _entry(
        "patch",
        "A patch of curved cells that is stretched, sheared and turned at once,",
        Borrowed(Patch("Q2/Q1", 2).body, "Q2/Q1"),
        1e-10,
        _STEEPER,
    ),
    _entry(
        "cook",
        "Cook's membrane in 4 by 4 cells at a quarter of the load,",
        Borrowed(partial(Panel("FINITE_QUARTER", "Q2/Q1").body, 4), "Q2/Q1", 5, 1e-8),
        1e-9,
        "both integrate by the same Gauss-Legendre rule, so that Newton's residual of 1e-8 N, at forces of 50 N, remains",
    ),
    _entry(
        "homogeneous",
        "A block of Mooney-Rivlin material pulled to 1.3 times its length,",
        Sample((MOONEY_RIVLIN, MIXED), SHORT_BAR, PULLED, "P2/P1", 4),
        1e-11,
        _CONSTANT,
    ),
    _entry(
        "bar_p2p1",
        "A neo-Hookean bar bent and twisted at once,",
        Sample((NEO_HOOKE, MIXED), BAR, TURNED, "P2/P1", 9),
        1e-10,
        _BAR_RULES,
    ),
    _entry(
        "bar_q1p0",
        "A neo-Hookean bar bent and twisted at once,",
        Sample((NEO_HOOKE, MIXED), BAR, TURNED, "Q1/P0", 3),
        1e-11,
        _SAME_RULE,
    ),
    _entry(
        "bar_p1",
        "A neo-Hookean bar with a penalty on its volume, bent and twisted at once,",
        Sample((NEO_HOOKE, PENALTY), BAR, TURNED, "P1", 2),
        1e-11,
        _CONSTANT,
    ),
    _entry(
        "bar_p1p1",
        "A bar of muscle whose linear pressure is stabilised, bent and twisted at once,",
        Sample((NEO_HOOKE, PASSIVE, MIXED), BAR, TURNED, "P1/P1", 2),
        1e-11,
        _CONSTANT,
    ),
    _entry(
        "mooney_rivlin",
        "A Mooney-Rivlin bar bent and twisted at once,",
        Sample((MOONEY_RIVLIN, MIXED), BAR, TURNED, "P2/P0", 9),
        1e-9,
        _BAR_RULES,
    ),
    _entry(
        "fibres",
        "A bar of muscle, fibres passive and active, bent and twisted at once,",
        Sample((NEO_HOOKE, PASSIVE, ACTIVE, MIXED), BAR, TURNED, "Q1/P0", 3),
        1e-11,
        _SAME_RULE,
    ),
    _entry(
        "prestretch",
        "A bar with FEBio's fibres, which are taut at rest and pull, bent and twisted at once,",
        Sample((NEO_HOOKE, FEBIO, TENSION, PRESTRETCH, MIXED), BAR, TURNED, "Q1/P0", 3),
        1e-11,
        _SAME_RULE,
    ),
    _entry(
        "guccione",
        "A bar of Guccione's heart muscle with a penalty on its volume, bent and twisted at once,",
        Sample((GUCCIONE, PENALTY), SHORT_BAR, TURNED, "Q2", 5),
        1e-11,
        _SAME_RULE,
    ),
    _entry(
        "holzapfel_ogden",
        "A bar with two families of fibres and a penalty on its volume, bent and twisted at once,",
        Sample((HOLZAPFEL_OGDEN, NEO_HOOKE, PENALTY), BAR, TURNED, "Q1", 3),
        1e-11,
        _SAME_RULE,
    ),
    _entry(
        "loads",
        "A block of curved cells under its weight and a fluid that presses on one side, leaning on springs,",
        Sample((NEO_HOOKE, WEIGHT, FLUID, MIXED), CURVED_BLOCK, STANDING, "Q2/Q1", 5),
        1e-11,
        _SAME_RULE,
    ),
    _entry(
        "loads_p2",
        "A block under its weight and a fluid that presses on one side, leaning on springs,",
        Sample((NEO_HOOKE, WEIGHT, FLUID, PENALTY), BLOCK, STANDING, "P2", 9),
        1e-11,
        _BLOCK_RULES,
    ),
)
