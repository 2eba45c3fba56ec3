"""Blocks in homogeneous states. Every element represents linear functions exactly, so only rounding remains.

The entries of ``fibres`` and ``loads`` use ``Specimen`` too. The bulk modulus is finite in the body as well as in the closed form.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from fem_reference.assessment.catalogue import Entry, Lab
from fem_reference.effects import Effect, make
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import Affine, Along, Matrix, radially
from fem_reference.runs.store import Frame
from fem_reference.verification.parts import NO_GRADIENT, SURFACE, SYMMETRY, control, find, resistance

laws = find("laws")
Vector = tuple[float, float, float]
X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
MU, BULK = 0.01, 10.0  # MPa
SIZE = (3.0, 2.0, 1.5)  # mm
STEPS = {"first_step": 0.25, "residual": 1e-13}


@dataclass(frozen=True, eq=False)
class Material:
    """The ``effects`` of a body, except its resistance to volume change, and the same material as a ``law`` of ``validation/``."""

    effects: tuple[Effect, ...]
    law: object

    def __add__(self, other: "Material") -> "Material":
        return Material((*self.effects, *other.effects), laws.Together((self.law, other.law)))


def neo_hooke(mu: float) -> Material:
    """A neo-Hookean law with the shear modulus ``mu`` [MPa]."""
    return Material((make("neo_hooke", mu=f"{mu} MPa"),), laws.neo_hooke(mu))


def mooney_rivlin(c1: float, c2: float) -> Material:
    """A Mooney-Rivlin law with ``c1`` and ``c2`` [MPa]."""
    return Material((make("mooney_rivlin", c1=f"{c1} MPa", c2=f"{c2} MPa"),), laws.MooneyRivlin(c1, c2))


def guccione(c: float) -> Material:
    """Guccione's law with ``c`` [MPa] and the exponents of Land et al. 2015, problem 1."""
    return Material((make("guccione", c=f"{c} MPa", bf=8.0, bt=2.0, bfs=4.0),), laws.Guccione(c, 8.0, 2.0, 4.0))


def stretched(face: str, stretch: float) -> Prescribed:
    """The face x1, y1 or z1 moved along its normal to ``stretch`` times its distance from the origin."""
    return Prescribed(face, face, ("xyz".index(face[0]),), radially(stretch - 1))


def everywhere(gradient: Matrix) -> tuple[Prescribed, ...]:
    """The six faces of a box, moved by a displacement ``gradient`` (3, 3)."""
    return tuple(Prescribed(face, face, (0, 1, 2), Affine(gradient)) for face in SURFACE)


# For each function in validation/homogeneous.py: the prescribed motion for a stretch or amount of shear, and the pulled face.
MODES: dict[str, tuple[Callable[[float], tuple[Prescribed, ...]], str]] = {
    "uniaxial": (lambda stretch: (*SYMMETRY, stretched("x1", stretch)), "x1"),
    "equibiaxial": (lambda stretch: (*SYMMETRY, stretched("x1", stretch), stretched("y1", stretch)), "x1"),
    "planar": (lambda stretch: (*SYMMETRY, stretched("x1", stretch), stretched("y1", 1.0)), "x1"),
    "simple_shear": (lambda amount: everywhere(((0.0, amount, 0.0), *NO_GRADIENT[1:])), "y1"),
    "pulled": (lambda _: SYMMETRY, "x1"),
}


@dataclass(frozen=True, eq=False)
class Specimen:
    """A block of ``SIZE`` in a homogeneous state, given by a mode of ``MODES`` and its ``amount``: a stretch, a shear or, for the
    mode "pulled", the nominal stress [MPa] that the ``loads`` apply.
    """

    material: Material
    element: str
    mode: str
    amount: float
    fibre: Vector = X
    bulk: float = BULK
    loads: tuple[Effect, ...] = ()

    def body(self) -> Body:
        """The block, with two cells along each side."""
        acting = (*self.material.effects, resistance(self.element, self.bulk), *self.loads)
        mesh = shapes.box((2, 2, 2), SIZE, ELEMENTS[self.element][0])
        return Body(mesh, acting, MODES[self.mode][0](self.amount), (0, 1), Along(self.fibre))

    def last(self, lab: Lab) -> Frame:
        """The final state of the block."""
        return lab.solve(self.body(), self.element, **STEPS).last

    def _known(self) -> Any:
        mode = getattr(find("homogeneous"), self.mode)
        return mode(self.material.law, self.bulk, self.amount, np.array(self.fibre))

    def known_force(self) -> float:
        """The force [N]: the nominal stress times the area."""
        axis = "xyz".index(MODES[self.mode][1][0])
        return float(self._known().P[0, axis] * np.prod(np.delete(SIZE, axis)))

    def known_stretch(self, axis: int) -> float:
        """The stretch along x, y or z."""
        return float(self._known().stretches[axis])


def force(lab: Lab, specimen: Specimen) -> float:
    """The force [N] along x on the pulled face. In simple shear the forces at the edges shared with x0 and x1 cancel."""
    return float(specimen.last(lab).forces[MODES[specimen.mode][1]][0])


def stretch(lab: Lab, specimen: Specimen, axis: int) -> float:
    """The stretch of the block along x, y or z, from its outer dimension."""
    return float(np.ptp(specimen.last(lab).points[:, axis]) / SIZE[axis])


BLOCK = partial(
    Entry,
    within=1e-11,
    relative=True,
    because="The element represents the exact solution: only rounding and Newton's residual of 1e-13 N remain.",
    kind="closed form",
    source="validation/homogeneous.py: equilibrium by root finding (Ogden 1984, ch. 4.3)",
)


def force_entry(group: str, name: str, title: str, specimen: Specimen, negative_control: str, **wrong: Any) -> Entry:
    """The entry that compares the force on a ``specimen`` with its closed form. In the negative control, the fields in ``wrong``
    replace those of the specimen.
    """
    return BLOCK(
        name=name,
        group=group,
        title=title,
        unit="N",
        measure=force,
        given={"specimen": specimen},
        **control(negative_control, specimen=replace(specimen, **wrong)),
        truth=specimen.known_force,
    )


def stretch_entry(
    axis: int, group: str, name: str, title: str, specimen: Specimen, negative_control: str, **wrong: Any
) -> Entry:
    """The entry that compares the stretch of a ``specimen`` along an ``axis`` with its closed form."""
    other = force_entry(group, name, title, specimen, negative_control, **wrong)
    truth = partial(specimen.known_stretch, axis)
    return replace(other, unit="1", measure=stretch, given={**other.given, "axis": axis}, truth=truth)


GROUP = "homogeneous"
NEO, MOONEY, HEART = neo_hooke(MU), mooney_rivlin(0.003, 0.002), guccione(0.002)
STIFFER = "Shear modulus 1 % too high.", neo_hooke(1.01 * MU)
OTHER_LAW = "A neo-Hookean law with the same shear modulus.", NEO
STIFFER_MOONEY = "Both moduli 1 % too high.", mooney_rivlin(1.01 * 0.003, 1.01 * 0.002)
AMOUNTS = {
    "uniaxial": (1.6, "stretched along one axis, free laterally"),
    "equibiaxial": (1.3, "stretched equally along two axes"),
    "planar": (0.7, "shortened with its width fixed"),
    "simple_shear": (0.6, "in simple shear"),
}


ENTRIES = (
    *(
        force_entry(
            GROUP,
            f"{word}_{mode}_{element}".lower().replace("-", "_").replace("/", "_"),
            f"{word} block {AMOUNTS[mode][1]}, with {element}: force",
            Specimen(material, element, mode, AMOUNTS[mode][0]),
            negative_control,
            material=wrong,
        )
        for word, material, mode, element, (negative_control, wrong) in (
            ("Neo-Hookean", NEO, "uniaxial", "P2/P1", STIFFER),
            ("Neo-Hookean", NEO, "equibiaxial", "Q2/Q1", STIFFER),
            ("Neo-Hookean", NEO, "planar", "P2/P0", STIFFER),
            ("Neo-Hookean", NEO, "simple_shear", "Q1/P0", STIFFER),
            ("Mooney-Rivlin", MOONEY, "uniaxial", "Q2/Q1", OTHER_LAW),
            ("Mooney-Rivlin", MOONEY, "equibiaxial", "P2/P1", OTHER_LAW),
            ("Mooney-Rivlin", MOONEY, "planar", "Q1/P0", STIFFER_MOONEY),
            ("Mooney-Rivlin", MOONEY, "simple_shear", "P2/P0", STIFFER_MOONEY),
            ("Neo-Hookean", NEO, "uniaxial", "P1", STIFFER),
            ("Neo-Hookean", NEO, "uniaxial", "P2", STIFFER),
            ("Neo-Hookean", NEO, "uniaxial", "Q2", STIFFER),
        )
    ),
    stretch_entry(
        1,
        GROUP,
        "neo_hookean_thinning_p2",
        "Compressible neo-Hookean block stretched along one axis, with P2: its lateral stretch",
        Specimen(NEO, "P2", "uniaxial", 1.6, bulk=10 * MU),
        "Bulk modulus 1 % too high.",
        bulk=10.1 * MU,
    ),
    *(
        force_entry(
            GROUP,
            f"guccione_{words}",
            f"Heart muscle (Guccione) stretched {words} its fibres: force",
            Specimen(HEART, "P2/P1", "uniaxial", 1.15, fibre),
            "Fibres turned by a right angle.",
            fibre=other,
        )
        for words, fibre, other in (("along", X, Y), ("across", Y, X))
    ),
)
