"""Blocks of muscle whose fibres resist, contract or are prestretched. All states are homogeneous, so finite elements are exact."""

from dataclasses import replace
from functools import partial

import numpy as np

from fem_reference.effects import make
from fem_reference.verification.homogeneous import NEO, Material, Specimen, Y, force_entry, stretch_entry
from fem_reference.verification.parts import find, ramp

STRESS, OPTIMUM = 0.3, 1.05  # the peak active stress [MPa] and the fibre stretch at which it is reached
laws, fibre_laws = find("laws"), find("fibre_laws")


def passive(stress: float = STRESS, linear_from: float = 1.4) -> Material:
    """Blemker's passive fibres with a ``stress`` [MPa], slack up to a stretch of ``OPTIMUM``."""
    numbers = {"p1": 0.05, "p2": 6.6, "optimal_stretch": OPTIMUM, "linear_from": linear_from}
    acting = make("fibre_passive", stress=f"{stress} MPa", **numbers)
    return Material((acting,), fibre_laws.FibrePassive(stress, *numbers.values()))


def passive_febio(c4: float = 6.0, c5: float = 0.3) -> Material:
    """FEBio's passive fibres, slack up to a stretch of 1; ``c5`` [MPa]."""
    acting = make("fibre_passive_febio", c3="0.01 MPa", c4=c4, c5=f"{c5} MPa", linear_from=1.4)
    return Material((acting,), fibre_laws.FibrePassiveFebio(0.01, c4, c5, 1.4))


def active(activation: float = 1.0, stress: float = STRESS) -> Material:
    """Blemker's active fibres, with an activation that grows from 0 at frame 0 to ``activation`` at frame 1; ``stress`` [MPa]."""
    acting = make("fibre_active", ramp=ramp(activation), stress=f"{stress} MPa", optimal_stretch=OPTIMUM)
    return Material((acting,), fibre_laws.FibreActive(stress, OPTIMUM, activation))


def two_families(degrees: float) -> Material:
    """Two families of fibres, at plus and minus ``degrees`` from the fibre direction in the plane normal to z."""
    normal = (0.0, 0.0, 1.0)
    acting = make("holzapfel_ogden", k1="0.01 MPa", k2=1.0, angle=f"{degrees} deg", normal=normal)
    return Material((acting,), laws.HolzapfelOgden(0.01, 1.0, np.radians(degrees), normal))


def tension(activation: float = 1.0) -> Material:
    """A constant active tension of 0.06 MPa, times ``activation``."""
    acting = make("active_tension", tension="0.06 MPa", ramp=ramp(activation))
    return Material((acting,), laws.ActiveTension(0.06 * activation))


def taut(material: Material, stretch: float) -> Material:
    """``material`` with fibres that are stretched at rest by ``stretch``."""
    acting = make("prestretch", stretch=stretch, ramp=ramp())
    return Material((*material.effects, acting), laws.Prestretched(material.law, stretch))


def muscle(fibres: Material, stretch: float) -> Specimen:
    """A block with fibres along x in a neo-Hookean matrix, held at a ``stretch``."""
    return Specimen(NEO + fibres, "P2/P1", "uniaxial", stretch)


def free(material: Material) -> Specimen:
    """A block without a load."""
    return Specimen(material, "P2/P1", "pulled", 0.0)


force, length = partial(force_entry, "fibres"), partial(stretch_entry, 0, "fibres")
TOE, LINE = (1.25, "into the toe region"), (1.6, "beyond the toe region")  # stretches on both parts of the curve
STRONGER = "Peak stress 1 % too high."
FAMILIES = NEO + two_families(30.0)
TAUT, TAUTER = taut(NEO + passive(), 1.2), {"material": taut(NEO + passive(), 1.212)}

ENTRIES = (
    *(
        force(
            f"passive_{name}",
            f"Passive fibres ({law}) stretched {words}: force",
            muscle(right, stretch),
            negative_control,
            material=NEO + wrong,
        )
        for name, law, (stretch, words), right, negative_control, wrong in (
            ("toe", "Blemker", TOE, passive(), STRONGER, passive(1.01 * STRESS)),
            ("line", "Blemker", LINE, passive(), "Linear from a stretch of 1.45, not 1.4.", passive(linear_from=1.45)),
            ("febio_toe", "FEBio", TOE, passive_febio(), "The exponent c4 1 % too high.", passive_febio(c4=6.06)),
            ("febio_line", "FEBio", LINE, passive_febio(), "The slope c5 1 % too high.", passive_febio(c5=0.303)),
        )
    ),
    replace(
        force(
            "passive_slack",
            "Passive fibres (Blemker) that are shortened carry no force: force of the matrix alone",
            muscle(passive(), 0.8),
            "The fibres lie across the block, which widens in their direction.",
            fibre=Y,
        ),
        truth=Specimen(NEO, "P2/P1", "uniaxial", 0.8).known_force,
    ),
    force(
        "active_isometric",
        "Active fibres fixed at rest length: force",
        muscle(active(), 1.0),
        "Half the activation.",
        material=NEO + active(0.5),
    ),
    *(
        force(
            f"active_{limb}",
            f"Active fibres fixed at a stretch of {stretch}, on the {limb} limb of the force-length curve: force",
            muscle(active(), stretch),
            STRONGER,
            material=NEO + active(stress=1.01 * STRESS),
        )
        for limb, stretch in (("ascending", 0.6), ("descending", 1.6))
    ),
    length(
        "active_shortening",
        "Active fibres free to shorten: ratio of length to rest length",
        free(NEO + active(0.1)),
        "Half the activation.",
        material=NEO + active(0.05),
    ),
    force(
        "passive_and_active",
        "Passive and half-activated fibres together, fixed at a stretch above 1: force",
        muscle(passive() + active(0.5), 1.25),
        "Activation 1 % too low.",
        material=NEO + (passive() + active(0.495)),
    ),
    force(
        "active_tension",
        "Fibres of constant tension fixed at 0.9 of their rest length: force",
        muscle(tension(), 0.9),
        "Half the tension.",
        material=NEO + tension(0.5),
    ),
    *(
        force(
            f"two_families_{mode}",
            f"Two families of fibres (Holzapfel-Ogden) {words}: force along their mean direction",
            Specimen(FAMILIES, "P2/P1", mode, 1.25),
            "The families are at 31 instead of 30 degrees.",
            material=NEO + two_families(31.0),
        )
        for mode, words in (
            ("uniaxial", "stretched along their bisector"),
            ("equibiaxial", "stretched in their plane"),
        )
    ),
    force(
        "prestretch_fixed",
        "Muscle with a prestretch of 1.2, fixed at its length: force",
        Specimen(TAUT, "P2/P1", "uniaxial", 1.0),
        "Prestretch 1 % too high.",
        **TAUTER,
    ),
    replace(
        length(
            "prestretch_released",
            "Muscle with a prestretch of 1.2, released: length divided by that of the mesh, 1 / 1.2",
            free(TAUT),
            "Prestretch 1 % too high.",
            **TAUTER,
        ),
        truth=1 / 1.2,
        source="The stretch that undoes the prestretch leaves no elastic energy.",
    ),
)
