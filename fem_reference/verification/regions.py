"""Regions: a bar of two materials in series, one a thousand times as stiff, with an interface on cell faces or a transition."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fem_reference.assessment.catalogue import Entry, Lab, Refinement
from fem_reference.effects import make
from fem_reference.foundations.mesh import Floats
from fem_reference.geometry.regions import Blended
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body
from fem_reference.verification.homogeneous import stretched
from fem_reference.verification.parts import control, find, resistance, sliding

series = find("series")
SIZE, LONGER = (10.0, 2.0, 2.0), 1.2  # [mm], and the stretch; the cross-section stays constant
MU, BULK, RATIO = 0.01, 0.1, 1000.0  # [MPa] of the soft material, and the ratio of the stiffnesses
STIFF, WIDTH = 4.0, 2.0  # length of the stiff part and width of the transition [mm]


@dataclass(frozen=True)
class Below:
    """The depth [mm] below the plane at ``x`` [mm], positive on the side of smaller x."""

    x: float

    def __call__(self, points: Floats) -> Floats:
        """The depths (n,) [mm] of ``points`` (n, 3) [mm]."""
        return np.asarray(self.x - points[:, 0])


def bar(element: str, cells: int, width: float, stiff: float = STIFF) -> Body:
    """The bar with ``cells`` cells along its length. Its first ``stiff`` mm are a thousand times as stiff as the rest."""
    mesh, laws = shapes.box((cells, 1, 1), SIZE, ELEMENTS[element][0]), []
    for region, factor in (("tendon", RATIO), ("not tendon", 1.0)):
        laws.append(make("neo_hooke", mu=factor * MU, **{"in": region}))
        laws.append(resistance(element, factor * BULK).model_copy(update={"region": region}))
    fixed = *sliding("x0", "y0", "y1", "z0", "z1"), stretched("x1", LONGER)
    return Body(mesh, tuple(laws), fixed, (0, 1), regions={"tendon": Blended(Below(stiff), width)})


def force(lab: Lab, cells: int, element: str, width: float, stiff: float = STIFF) -> float:
    """The force [N] that stretches the bar."""
    solved = lab.solve(bar(element, cells, width, stiff), element, first_step=0.25, residual=1e-11)
    return float(solved.last.forces["x1"][0])


def truth(width: float) -> float:
    """The force [N] according to the closed form."""
    return float(series.stress(MU, BULK, RATIO, (STIFF, width, SIZE[0]), LONGER * SIZE[0])) * SIZE[1] * SIZE[2]


ALIGNED = Entry(
    name="series_bar",
    group="regions",
    title="Bar of two materials in series, one a thousand times as stiff, with an interface on cell faces, with P2: force",
    unit="N",
    measure=force,
    given={"cells": 10, "element": "P2", "width": 0.0},
    **control("The stiff part is longer by one cell.", stiff=STIFF + 1),
    truth=partial(truth, 0.0),
    relative=True,
    within=1e-10,
    because="The element represents displacements that are linear in each part; only the residual of 1e-11 N remains "
    "(the force is 0.15 N).",
    kind="closed form",
    source="Equal nominal stress in both parts (validation/series.py).",
)

ENTRIES = (
    ALIGNED,
    replace(
        ALIGNED,
        name="series_bar_mixed",
        title="Bar of two materials in series, one a thousand times as stiff, with an interface on cell faces, with P2/P1: force",
        given={"cells": 10, "element": "P2/P1", "width": 0.0},
        within=1e-6,
        because="The exact pressure jumps at the interface; the discrete pressure is continuous and oscillates in the cells next "
        "to it. The stiff cells hardly deform under any pressure; a relative error of about 1 / ratio^2 remains.",
    ),
    replace(
        ALIGNED,
        name="series_bar_transition",
        title="Bar of two materials in series, one a thousand times as stiff, with a transition of 2 mm, with P2: force",
        given={"element": "P2", "width": WIDTH},
        **control("No transition.", width=0.0),
        truth=partial(truth, WIDTH),
        within=5e-5,
        because="The energy, and with it the force, converges at order 4 with quadratic cells, down to cells of 0.25 mm.",
        refinement=Refinement((10, 20, 40), SIZE[0], 4.0),
    ),
)
