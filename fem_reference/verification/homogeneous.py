"""Blocks in homogeneous states: finite elements that represent linear functions are exact there, so only rounding is left.

``Specimen`` serves the entries of fibres and loads too. The bulk modulus is finite in the body and in the truth alike.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem_reference.assessment.catalogue import Entry, Finding, Lab
from fem_reference.effects import Effect, make
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import Affine, Along, Matrix, Radial
from fem_reference.runs.solved import Solved
from fem_reference.verification import truths
from fem_reference.verification.parts import SYMMETRY, resistance

Vector = tuple[float, float, float]
X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
MU, BULK = 0.01, 10.0  # MPa
SIZE = (3.0, 2.0, 1.5)  # mm
STEPS = {"first_step": 0.25, "residual": 1e-13}


@dataclass(frozen=True, eq=False)
class Material:
    """The ``effects`` of a body, but its resistance to volume change, and their ``law`` in ``validation/``."""

    effects: tuple[Effect, ...]
    law: Callable[[], Any]

    def __add__(self, other: "Material") -> "Material":
        both = (self.law, other.law)
        return Material(
            (*self.effects, *other.effects), lambda: truths.find("laws").Together(tuple(law() for law in both))
        )


def neo_hooke(mu: float = MU) -> Material:
    """``mu`` [MPa]."""
    return Material((make("neo_hooke", mu=f"{mu} MPa"),), lambda: truths.find("laws").neo_hooke(mu))


def mooney_rivlin(c1: float, c2: float) -> Material:
    """``c1``, ``c2`` [MPa]."""
    acting = make("mooney_rivlin", c1=f"{c1} MPa", c2=f"{c2} MPa")
    return Material((acting,), lambda: truths.find("laws").MooneyRivlin(c1, c2))


def guccione(c: float) -> Material:
    """``c`` [MPa], with the exponents of Land et al. 2015, problem 1."""
    acting = make("guccione", c=f"{c} MPa", bf=8.0, bt=2.0, bfs=4.0)
    return Material((acting,), lambda: truths.find("laws").Guccione(c, 8.0, 2.0, 4.0))


def stretched(face: str, stretch: float) -> Prescribed:
    """The face x1, y1 or z1 moved along its normal to ``stretch`` times its distance."""
    return Prescribed(face, face, ("xyz".index(face[0]),), Radial(stretch - 1))


def everywhere(gradient: Matrix) -> tuple[Prescribed, ...]:
    """The whole surface of a box moved by a displacement gradient (3, 3)."""
    return tuple(Prescribed(face, face, (0, 1, 2), Affine(gradient)) for face in ("x0", "x1", "y0", "y1", "z0", "z1"))


def _sheared(amount: float) -> tuple[Prescribed, ...]:
    return everywhere(((0.0, amount, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))


# By name of a function of validation/homogeneous.py: what is prescribed for a stretch or an amount, and the face that is pulled.
MODES: dict[str, tuple[Callable[[float], tuple[Prescribed, ...]], str]] = {
    "uniaxial": (lambda stretch: (*SYMMETRY, stretched("x1", stretch)), "x1"),
    "equibiaxial": (lambda stretch: (*SYMMETRY, stretched("x1", stretch), stretched("y1", stretch)), "x1"),
    "planar": (lambda stretch: (*SYMMETRY, stretched("x1", stretch), stretched("y1", 1.0)), "x1"),
    "simple_shear": (_sheared, "y1"),
    "pulled": (lambda _: SYMMETRY, "x1"),
}


@dataclass(frozen=True, eq=False)
class Specimen:
    """A block of ``SIZE`` in a homogeneous state: a mode of ``MODES`` and its ``amount``, a stretch, a shear or, where it is
    pulled, a nominal stress [MPa] that ``loads`` bring.
    """

    material: Material
    element: str
    mode: str
    amount: float
    fibre: Vector = X
    bulk: float = BULK
    loads: tuple[Effect, ...] = ()

    def body(self) -> Body:
        """The block in two cells a side."""
        acting = (*self.material.effects, resistance(self.element, self.bulk), *self.loads)
        mesh = shapes.box((2, 2, 2), SIZE, ELEMENTS[self.element][0])
        return Body(mesh, acting, MODES[self.mode][0](self.amount), (0, 1), Along(self.fibre))

    def solved(self, lab: Lab) -> Solved:
        """Its states."""
        return lab.solve(self.body(), self.element, **STEPS)

    def force(self, lab: Lab) -> Finding:
        """Along x on the face that is pulled [N]; sheared, x0 and x1 pull oppositely at its edges, and cancel."""
        return Finding(float(self.solved(lab).last.forces[MODES[self.mode][1]][0]))

    def stretch(self, axis: int, lab: Lab) -> Finding:
        """Of its outer dimension along x, y or z."""
        return Finding(float(np.ptp(self.solved(lab).last.points[:, axis]) / SIZE[axis]))

    def _known(self) -> Any:
        mode = getattr(truths.find("homogeneous"), self.mode)
        return mode(self.material.law(), self.bulk, self.amount, np.array(self.fibre))

    def known_force(self) -> float:
        """The nominal stress times the area [N]."""
        axis = "xyz".index(MODES[self.mode][1][0])
        return float(self._known().P[0, axis] * np.prod(np.delete(SIZE, axis)))

    def known_stretch(self, axis: int) -> float:
        """Along x, y or z."""
        return float(self._known().stretches[axis])


SOURCE = "validation/homogeneous.py: balance by root finding (Ogden 1984, ch. 4.3)"
EXACT = "The element represents the exact answer: what is left is rounding and the residual of 1e-13 N that ends Newton's method."


def force_entry(group: str, name: str, title: str, specimen: Specimen, control: tuple[str, Specimen]) -> Entry:
    """The force on a ``specimen`` against its truth; ``control``: what is wrong with the other specimen."""
    negative_control, wrong = control
    numbers = ("N", specimen.known_force, 1e-11, True)
    return Entry(
        name, group, title, *numbers, EXACT, "closed form", SOURCE, specimen.force, negative_control, wrong.force
    )


def stretch_entry(
    group: str, name: str, title: str, axis: int, specimen: Specimen, control: tuple[str, Specimen]
) -> Entry:
    """The stretch of a ``specimen`` along an axis against its truth."""
    negative_control, wrong = control
    measure, with_negative_control = (lambda lab: specimen.stretch(axis, lab)), (lambda lab: wrong.stretch(axis, lab))
    numbers = ("1", lambda: specimen.known_stretch(axis), 1e-11, True)
    return Entry(
        name, group, title, *numbers, EXACT, "closed form", SOURCE, measure, negative_control, with_negative_control
    )


GROUP = "homogeneous"
NEO, MOONEY, HEART = neo_hooke(), mooney_rivlin(0.003, 0.002), guccione(0.002)
STIFFER = "Shear modulus 1 % too high.", neo_hooke(1.01 * MU)
OTHER_LAW = "A neo-Hookean law of the same shear modulus.", NEO
STIFFER_MOONEY = "Both moduli 1 % too high.", mooney_rivlin(1.01 * 0.003, 1.01 * 0.002)
AMOUNTS = {
    "uniaxial": (1.6, "stretched along one axis, free across"),
    "equibiaxial": (1.3, "stretched alike along two axes"),
    "planar": (0.7, "shortened with its width fixed"),
    "simple_shear": (0.6, "in simple shear"),
}


def _isotropic(word: str, material: Material, mode: str, element: str, control: tuple[str, Material]) -> Entry:
    """A block of a law, which has a ``word``, in a mode; ``control``: the material that is wrong."""
    amount, words = AMOUNTS[mode]
    specimen = Specimen(material, element, mode, amount)
    name = f"{word}_{mode}_{element}".lower().replace("-", "_").replace("/", "_")
    title = f"{word} block {words}, by {element}: force"
    return force_entry(GROUP, name, title, specimen, (control[0], replace(specimen, material=control[1])))


def _heart(name: str, words: str, fibre: Vector, other: Vector) -> Entry:
    """Stretched along x, with its fibres along ``fibre``; wrong: along the ``other``."""
    specimen = Specimen(HEART, "P2/P1", "uniaxial", 1.15, fibre)
    title = f"Heart muscle (Guccione) stretched {words} its fibres: force"
    control = "Fibres turned by a right angle.", replace(specimen, fibre=other)
    return force_entry(GROUP, name, title, specimen, control)


def _lateral() -> Entry:
    """How much a rather compressible block thins."""
    specimen = Specimen(NEO, "P2", "uniaxial", 1.6, bulk=10 * MU)
    control = "Bulk modulus 1 % too high.", replace(specimen, bulk=10.1 * MU)
    title = "Compressible neo-Hookean block stretched along one axis, by P2: how much it thins"
    return stretch_entry(GROUP, "neo_hookean_thinning_p2", title, 1, specimen, control)


ENTRIES = (
    _isotropic("Neo-Hookean", NEO, "uniaxial", "P2/P1", STIFFER),
    _isotropic("Neo-Hookean", NEO, "equibiaxial", "Q2/Q1", STIFFER),
    _isotropic("Neo-Hookean", NEO, "planar", "P2/P0", STIFFER),
    _isotropic("Neo-Hookean", NEO, "simple_shear", "Q1/P0", STIFFER),
    _isotropic("Mooney-Rivlin", MOONEY, "uniaxial", "Q2/Q1", OTHER_LAW),
    _isotropic("Mooney-Rivlin", MOONEY, "equibiaxial", "P2/P1", OTHER_LAW),
    _isotropic("Mooney-Rivlin", MOONEY, "planar", "Q1/P0", STIFFER_MOONEY),
    _isotropic("Mooney-Rivlin", MOONEY, "simple_shear", "P2/P0", STIFFER_MOONEY),
    _isotropic("Neo-Hookean", NEO, "uniaxial", "P1", STIFFER),
    _isotropic("Neo-Hookean", NEO, "uniaxial", "P2", STIFFER),
    _isotropic("Neo-Hookean", NEO, "uniaxial", "Q2", STIFFER),
    _lateral(),
    _heart("guccione_along", "along", X, Y),
    _heart("guccione_across", "across", Y, X),
)
