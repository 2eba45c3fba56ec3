"""Cubes of muscle under load: quantities that were measured in experiments, and the same quantities computed for a material."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np

from fem_reference.assessment.experiments import Fact, find, ratio
from fem_reference.effects import Effect, make
from fem_reference.problems.cubes import FREE, CubeState, loaded

Material = tuple[Effect, ...]
SQUEEZED, STRETCHED = 0.9, 1.1
_CLEAR = 0.01  # the fraction by which the stiffness of a cube must differ for it to count as softer or stiffer
# The volume law of the case hip_flexion, after Blemker, Pinsky and Delp 2005, doi 10.1016/j.jbiomech.2004.04.009.
VOLUME = make("incompressible_penalty", bulk="10 MPa")
FIBRES = {"stress": 0.3, "p1": 0.05, "p2": 6.6, "optimal_stretch": 1.0, "linear_from": 1.4}
SHIPPED: Material = (make("neo_hooke", mu=0.01), VOLUME, make("fibre_passive", **FIBRES))


@dataclass(frozen=True, eq=False)
class Quantity:
    """A measured quantity of a cube.

    ``truth``: its value in ``unit``, from ``facts`` of an ``experiment``. ``within`` and ``because``: the uncertainty of this
    value, and the reason for it. ``of``: a function that computes the quantity for a material. ``limit``: the reason why the
    shipped law cannot reach the truth. ``is_order``: True for a ranking of stiffnesses: the value is 1 if the ranking is reproduced
    and 0 if it is not, and the tolerance is 0.5.
    """

    name: str
    title: str
    experiment: str
    of: Callable[[Material], float]
    facts: tuple[Fact, ...]
    truth: float
    within: float
    because: str
    limit: str = ""
    unit: str = "1"
    is_order: bool = False


def with_collagen(fibres: float, k1: float, k2: float) -> Material:
    """The shipped matrix with the effect ``collagen_across`` (``k1`` [MPa], ``k2``), and fibres with ``stress = fibres`` [MPa]."""
    passive = make("fibre_passive", **(FIBRES | {"stress": fibres}))
    return (*SHIPPED[:2], passive, make("collagen_across", k1=k1, k2=k2))


@lru_cache(1000)
def cube(material: Material, stretch: float, degrees: float, *, confined: bool = False) -> CubeState:
    """A cube loaded along x to a ``stretch``, with fibres in the xy plane at ``degrees`` to x; ``confined``: fixed along z."""
    fibre = np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees)), 0.0])
    return loaded(material, (stretch, FREE, 1.0 if confined else FREE), fibre)


def stress(material: Material, stretch: float, degrees: float, *, confined: bool = False) -> float:
    """The nominal stress [MPa] of a cube along the load."""
    return float(cube(material, stretch, degrees, confined=confined).P[0, 0])


def poisson(stretch: float, degrees: float, axis: int) -> Callable[[Material], float]:
    """A function from a material to the Poisson ratio of a cube, for the strain along ``axis``, y or z."""
    return lambda material: cube(material, stretch, degrees).poisson_ratio(0, axis)


def stiffness_ratio(stretch: float) -> Callable[[Material], float]:
    """A function from a material to the stress of a cube loaded along its fibres, divided by that of a cube loaded across them."""
    return lambda material: stress(material, stretch, 0) / stress(material, stretch, 90)


def _extreme(material: Material, *, degrees: float, softest: bool) -> float:
    """1 if, of cubes with fibres at 0, 45 and 90 degrees to the load, the one at ``degrees`` is the softest (or the stiffest) by
    more than 1 %, else 0.
    """
    found = {angle: abs(stress(material, SQUEEZED, angle)) for angle in (0.0, 45.0, 90.0)}
    own = found.pop(degrees)
    clear = own < (1 - _CLEAR) * min(found.values()) if softest else own > (1 + _CLEAR) * max(found.values())
    return float(clear)


def confinement(material: Material) -> float:
    """The stress across fibres in semi-confined compression, where they lengthen, divided by that in unconfined compression."""
    return stress(material, SQUEEZED, 90, confined=True) / stress(material, SQUEEZED, 90)


def both_orders(material: Material) -> float:
    """1 if a cube is stiffer along its fibres in compression and stiffer across them in tension, each by more than 1 %, else 0."""
    squeezed, stretched = (stiffness_ratio(stretch)(material) for stretch in (SQUEEZED, STRETCHED))
    return float(squeezed > 1 + _CLEAR and stretched < 1 - _CLEAR)


LOOCKE, WALTER, TAKAZA = "van_loocke_2006", "walter_2022", "takaza_2013"
_READ = "The text that was read states no standard deviation; we take 0.05, because its values have two digits."
_TENSION_ONLY = (
    "Fibres that pull in tension only are slack in compression along them, where the matrix alone resists; across the load they "
    "are stretched and resist."
)
_CHOSEN = "The value is recalled; the tolerance of 0.1 is chosen by us."
_BARE = "Fibres resist tension along them, and only the matrix resists across them."


def _squeezed(name: str, title: str, condition: str, degrees: float, axis: int) -> Quantity:
    """A Poisson ratio in compression, with the fibres at an angle to the load."""
    fact, limit = find(LOOCKE, "poisson_ratio", condition), _TENSION_ONLY if degrees else ""
    title = f"Cube compressed {title}"
    return Quantity(name, title, LOOCKE, poisson(SQUEEZED, degrees, axis), (fact,), fact.value, 0.05, _READ, limit)


def _pulled(name: str, title: str, condition: str, axis: int) -> Quantity:
    """A Poisson ratio in tension across the fibres."""
    fact, title = find(TAKAZA, "poisson_ratio", condition), f"Strip pulled across its fibres: Poisson ratio {title}"
    of = poisson(STRETCHED, 90, axis)
    return Quantity(name, title, TAKAZA, of, (fact,), fact.value, 0.1, _CHOSEN, _BARE)


def _ratio_by_symmetry() -> Quantity:
    """The ratio of Young's moduli along and across the fibres: as the compliance is symmetric, the ratio of two Poisson ratios."""
    along, across = (find(LOOCKE, "poisson_ratio", words) for words in ("both strains across", "strain along them"))
    truth = along.value / across.value
    within = truth * math.hypot(0.05 / along.value, 0.05 / across.value)
    because = "The ratio of two Poisson ratios, 0.5 and 0.36, each known to within 0.05."
    title = "Cube in compression: ratio of stress along the fibres to stress across them"
    of = stiffness_ratio(SQUEEZED)
    return Quantity("cube_stiffness_ratio", title, LOOCKE, of, (along, across), truth, within, because, _TENSION_ONLY)


def _confinement() -> Quantity:
    facts = find(WALTER, "axial_stress", "mode II"), find(WALTER, "axial_stress", "at 90 degrees")
    truth, sd = ratio(*facts)
    because = "Standard deviation of the ratio of two stresses, -36.7 and -7.7 kPa; the abstract states no strain."
    title = "Ratio of the stress in semi-confined compression (fibres lengthen) to that in unconfined compression across them"
    return Quantity("cube_confinement", title, WALTER, confinement, facts, truth, sd, because)


def _tension() -> Quantity:
    facts = tuple(find(TAKAZA, "axial_stress", f"{words} the fibres") for words in ("along", "across"))
    title = "Strip at a stretch of 1.1: ratio of stress along the fibres to stress across them"
    because = "Both stresses are recalled and have no standard deviations, so the tolerance equals the ratio itself."
    truth = facts[0].value / facts[1].value
    of = stiffness_ratio(STRETCHED)
    return Quantity("strip_stiffness_ratio", title, TAKAZA, of, facts, truth, truth, because, _BARE)


def _order(name: str, title: str, fact: Fact, of: Callable[[Material], float], limit: str = "") -> Quantity:
    because = "A ranking: 1 if reproduced by a margin of at least 1 %, else 0."
    title = f"Cube in compression: {title}"
    return Quantity(name, title, fact.experiment, of, (fact,), 1.0, 0.5, because, limit, is_order=True)


_MIDWAY, _ACROSS = find(LOOCKE, "softest_angle", ""), find(WALTER, "stiffest_angle", "")
_SOFTEST, _STIFFEST = partial(_extreme, degrees=45.0, softest=True), partial(_extreme, degrees=90.0, softest=False)
_OTHER = "in the other transverse direction"

QUANTITIES = (
    _squeezed("cube_poisson_along", "along its fibres: Poisson ratio", "both strains across", 0, 1),
    _squeezed(
        "cube_poisson_fibre", "across its fibres: Poisson ratio along them", "across the fibres; strain along", 90, 1
    ),
    _squeezed(
        "cube_poisson_across", f"across its fibres: Poisson ratio {_OTHER}", "across the fibres; strain across", 90, 2
    ),
    _ratio_by_symmetry(),
    _order("cube_softest_midway", "softest with fibres at 45 degrees", _MIDWAY, _SOFTEST, _TENSION_ONLY),
    _order("cube_stiffest_across", "stiffest across its fibres (soleus of rabbits)", _ACROSS, _STIFFEST),
    _confinement(),
    _tension(),
    _pulled("strip_poisson_fibre", "along them", "across the fibres; strain along", 1),
    _pulled("strip_poisson_across", _OTHER, "across the fibres; strain across", 2),
)
