"""The shipped material compared with measured muscles. It was chosen from other sources and never fitted to these measurements.

An entry states whether the value lies within the uncertainty of the experiment; a value outside is a finding, not a failure. The
value is pinned, so that a change of a law or of the material is noticed.
"""

from dataclasses import replace
from functools import partial

from fem_reference.assessment import muscle_cubes
from fem_reference.assessment.catalogue import Entry, Finding, Lab
from fem_reference.assessment.muscle_cubes import QUANTITIES, SHIPPED, Material, Quantity, with_collagen
from fem_reference.effects import make

EXPERIMENT = partial(Entry, group="experiments", kind="experiment")
STIFFER = (make("neo_hooke", mu=0.011), *SHIPPED[1:])
ISOTROPIC = SHIPPED[:2]
COLLAGEN = with_collagen(0.3, 0.2, 1.5)
# The value of each entry with the shipped material. These pins guard against unintended change and validate nothing.
PINNED = {
    "cube_poisson_along": 0.4995238,
    "cube_poisson_fibre": 0.1466180,
    "cube_poisson_across": 0.8521583,
    "cube_stiffness_ratio": 0.7783656,
    "cube_softest_midway": 0.0,
    "cube_stiffest_across": 1.0,
    "cube_confinement": 5.6871806,
    "strip_stiffness_ratio": 6.1090860,
    "strip_poisson_fibre": 0.4994741,
    "strip_poisson_across": 0.4994741,
}


def measured(_: Lab, quantity: Quantity, material: Material) -> Finding:
    """The value of a ``quantity`` for a ``material``, with a note on why the shipped material cannot reach the measured value."""
    return Finding(quantity.of(material), note=f"Known limit: {quantity.limit}" if quantity.limit else "")


def _control(name: str) -> tuple[str, Material]:
    """The negative control of a quantity: its description and its material."""
    if name == "cube_softest_midway":
        return "Collagen across the fibres.", COLLAGEN
    return ("No fibres.", ISOTROPIC) if name == "cube_stiffest_across" else ("Shear modulus 10 % too high.", STIFFER)


def _entry(quantity: Quantity) -> Entry:
    first = quantity.facts[0]
    confirmed = "" if first.doi_confirmed == "yes" else " (recalled)"
    return _of(
        quantity,
        (SHIPPED, *_control(quantity.name)),
        PINNED[quantity.name],
        f"{quantity.experiment}, read in: {first.read_in}; doi {first.doi}{confirmed}",
        from_memory=any(one.doi_confirmed == "no" for one in quantity.facts),
    )


def _of(
    quantity: Quantity, tried: tuple[Material, str, Material], pinned: float, source: str, *, from_memory: bool = True
) -> Entry:
    """The entry for a quantity. ``tried``: the material, and the description and the material of the negative control."""
    return EXPERIMENT(
        name=quantity.name,
        title=quantity.title,
        unit=quantity.unit,
        measure=measured,
        given={"quantity": quantity, "material": tried[0]},
        negative_control=tried[1],
        wrong={"material": tried[2]},
        truth=quantity.truth,
        within=quantity.within,
        because=quantity.because,
        source=source,
        pinned=pinned,
        facts=quantity.facts,
        is_order=quantity.is_order,
        from_memory=from_memory,
    )


_BOTH = "van_loocke_2006, read in: quotation; takaza_2013, recalled"
ORDERS = Quantity(
    name="cube_both_orders",
    title="Stiffer along the fibres in compression and across them in tension",
    experiment="takaza_2013",
    of=muscle_cubes.both_orders,
    facts=(),
    truth=1.0,
    within=0.5,
    because="The answer is yes (1: both differences are at least 1 %) or no (0).",
    limit="A law whose fibres resist tension alone reproduces neither.",
    is_order=True,
)


WITH_COLLAGEN = replace(
    ORDERS, name="cube_both_orders_collagen", title=f"{ORDERS.title}: with collagen across the fibres", limit=""
)

ENTRIES = (
    *map(_entry, QUANTITIES),
    _of(ORDERS, (SHIPPED, "Collagen across the fibres.", COLLAGEN), 0.0, _BOTH),
    _of(WITH_COLLAGEN, (COLLAGEN, "No collagen.", SHIPPED), 1.0, _BOTH),
)
