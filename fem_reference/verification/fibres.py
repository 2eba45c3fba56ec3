"""Blocks of muscle whose fibres resist, pull or are taut at rest; all homogeneous, so that finite elements are exact."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from fem_reference.assessment.catalogue import Entry
from fem_reference.effects import make
from fem_reference.verification import truths
from fem_reference.verification.homogeneous import (
    NEO,
    Material,
    Specimen,
    Y,
    force_entry,
    stretch_entry,
)
from fem_reference.verification.parts import ramp

GROUP = "fibres"
STRESS, OPTIMUM = 0.3, 1.05  # the peak active stress [MPa] and the fibre stretch at which it is reached


def _fibre_law(name: str, *parameters: float) -> Callable[[], Any]:
    return lambda: getattr(truths.find("fibre_laws"), name)(*parameters)


def _law(name: str, *parameters: Any) -> Callable[[], Any]:
    return lambda: getattr(truths.find("laws"), name)(*parameters)


def passive(stress: float = STRESS, linear_from: float = 1.4) -> Material:
    """Blemker's passive fibres, ``stress`` [MPa]; slack up to ``OPTIMUM``."""
    numbers = {"p1": 0.05, "p2": 6.6, "optimal_stretch": OPTIMUM, "linear_from": linear_from}
    acting = make("fibre_passive", stress=f"{stress} MPa", **numbers)
    return Material((acting,), _fibre_law("FibrePassive", stress, *numbers.values()))


def passive_febio(c4: float = 6.0, c5: float = 0.3) -> Material:
    """FEBio's passive fibres, slack up to 1; ``c5`` [MPa]."""
    acting = make("fibre_passive_febio", c3="0.01 MPa", c4=c4, c5=f"{c5} MPa", linear_from=1.4)
    return Material((acting,), _fibre_law("FibrePassiveFebio", 0.01, c4, c5, 1.4))


def active(activation: float = 1.0, stress: float = STRESS) -> Material:
    """Blemker's active fibres at an ``activation`` that grows to its full from frame 0 to 1; ``stress`` [MPa]."""
    numbers = {"stress": f"{stress} MPa", "optimal_stretch": OPTIMUM}
    acting = make("fibre_active", ramp=ramp(activation), **numbers)
    return Material((acting,), _fibre_law("FibreActive", stress, OPTIMUM, activation))


def two_families(degrees: float) -> Material:
    """Two families at plus and minus ``degrees`` from the fibre, in the plane across z."""
    normal = (0.0, 0.0, 1.0)
    acting = make("holzapfel_ogden", k1="0.01 MPa", k2=1.0, angle=f"{degrees} deg", normal=normal)
    return Material((acting,), _law("HolzapfelOgden", 0.01, 1.0, np.radians(degrees), normal))


def tension(activation: float = 1.0) -> Material:
    """A constant active tension of 0.06 MPa, times ``activation``."""
    acting = make("active_tension", tension="0.06 MPa", ramp=ramp(activation))
    return Material((acting,), _law("ActiveTension", 0.06 * activation))


def taut(material: Material, stretch: float) -> Material:
    """``material`` whose fibres are stretched at rest by ``stretch``."""
    acting = make("prestretch", stretch=stretch, ramp=ramp())
    return Material((*material.effects, acting), lambda: truths.find("laws").Prestretched(material.law(), stretch))


def _fixed(fibres: Material, stretch: float = 1.0) -> Specimen:
    """Fibres along x in a neo-Hookean matrix, fixed at a stretch."""
    return Specimen(NEO + fibres, "P2/P1", "uniaxial", stretch)


def _free(fibres: Material) -> Specimen:
    """Fibres along x in a neo-Hookean matrix that nothing pulls."""
    return Specimen(NEO + fibres, "P2/P1", "pulled", 0.0)


_force, _stretch = partial(force_entry, GROUP), partial(stretch_entry, GROUP)


def _slack() -> Entry:
    """Shortened along its fibres, which carry nothing: the truth is that of the matrix alone."""
    muscle, matrix = _fixed(passive(), 0.8), Specimen(NEO, "P2/P1", "uniaxial", 0.8)
    control = "Fibres across, where the block grows wider.", replace(muscle, fibre=Y)
    title = "Passive fibres (Blemker) that are shortened carry nothing: force of the matrix alone"
    return replace(_force("passive_slack", title, muscle, control), truth=matrix.known_force)


def _passive() -> tuple[Entry, ...]:
    """In the toe and beyond, by both laws, and slack."""
    plans = {
        "passive_toe": ("Blemker", passive(), "Peak stress 1 % too high.", passive(1.01 * STRESS)),
        "passive_line": ("Blemker", passive(), "The line begins at 1.45 instead of 1.4.", passive(linear_from=1.45)),
        "passive_febio_toe": ("FEBio", passive_febio(), "The exponent c4 1 % too high.", passive_febio(c4=6.06)),
        "passive_febio_line": ("FEBio", passive_febio(), "The slope c5 1 % too high.", passive_febio(c5=0.303)),
    }
    places = {"toe": (1.25, "into their toe"), "line": (1.6, "beyond their toe")}
    found = []
    for name, (law, right, control, wrong) in plans.items():
        stretch, words = places[name.rsplit("_", 1)[1]]
        title = f"Passive fibres ({law}) stretched {words}: force"
        found.append(_force(name, title, _fixed(right, stretch), (control, _fixed(wrong, stretch))))
    return (*found, _slack())


def _active() -> tuple[Entry, ...]:
    """On both limbs of the force-length curve and between, free to shorten, and beside passive fibres."""
    half = "Half the activation.", _fixed(active(0.5))
    stronger = "Peak stress 1 % too high.", active(stress=1.01 * STRESS)
    limbs = {"ascending": (0.6, "short"), "descending": (1.6, "long")}
    both, weaker = passive() + active(0.5), passive() + active(0.495)
    return (
        _force("active_isometric", "Active fibres fixed at rest length: force", _fixed(active()), half),
        *(
            _force(
                f"active_{limb}",
                f"Active fibres fixed {length}, on the {limb} limb of the force-length curve: force",
                _fixed(active(), stretch),
                (stronger[0], _fixed(stronger[1], stretch)),
            )
            for limb, (stretch, length) in limbs.items()
        ),
        _stretch(
            "active_shortening",
            "Active fibres free to shorten: length over that at rest",
            0,
            _free(active(0.1)),
            ("Half the activation.", _free(active(0.05))),
        ),
        _force(
            "passive_and_active",
            "Passive and half activated fibres together, fixed long: force",
            _fixed(both, 1.25),
            ("Activation 1 % too low.", _fixed(weaker, 1.25)),
        ),
        _force(
            "active_tension",
            "Fibres of constant tension fixed at 0.9 of their rest length: force",
            _fixed(tension(), 0.9),
            ("Half the tension.", _fixed(tension(0.5), 0.9)),
        ),
    )


def _families() -> tuple[Entry, ...]:
    """Two families, symmetric about x."""
    pulled = Specimen(NEO + two_families(30.0), "P2/P1", "uniaxial", 1.25)
    wrong = "Families at 31 instead of 30 degrees.", NEO + two_families(31.0)
    return tuple(
        _force(
            f"two_families_{mode}",
            f"Two families of fibres (Holzapfel-Ogden) {words}: force along their mean direction",
            replace(pulled, mode=mode),
            (wrong[0], replace(pulled, mode=mode, material=wrong[1])),
        )
        for mode, words in (("uniaxial", "stretched midway between them"), ("equibiaxial", "stretched in their plane"))
    )


def _prestretched() -> tuple[Entry, ...]:
    """Fibres that are taut in the mesh: fixed they pull, released they shorten to where the matrix rests and they are slack."""
    muscle, wrong = taut(NEO + passive(), 1.2), ("Prestretch 1 % too high.", taut(NEO + passive(), 1.212))
    fixed = Specimen(muscle, "P2/P1", "uniaxial", 1.0)
    free = Specimen(muscle, "P2/P1", "pulled", 0.0)
    released = _stretch(
        "prestretch_released",
        "Muscle prestretched by 1.2 and released: length over that in the mesh, 1 / 1.2",
        0,
        free,
        (wrong[0], replace(free, material=wrong[1])),
    )
    title = "Muscle prestretched by 1.2 and fixed: force"
    return (
        _force("prestretch_fixed", title, fixed, (wrong[0], replace(fixed, material=wrong[1]))),
        replace(released, truth=lambda: 1 / 1.2, source="The stretch that undoes the prestretch leaves no energy."),
    )


ENTRIES = (*_passive(), *_active(), *_families(), *_prestretched())
