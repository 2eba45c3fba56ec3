"""Cook's membrane: a tapered panel in plane strain, clamped at one side, that a shear load bends and shears.

Most panels are nearly incompressible. A panel is one layer of cells, whose two faces stay in their planes. The small-strain
solution is computed under a load so small that the response is linear, and is then scaled up.
"""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from fem_reference.assessment.catalogue import Entry, Lab, Refinement
from fem_reference.effects import make
from fem_reference.foundations.mesh import Floats
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body
from fem_reference.verification.parts import SLOW, clamped, control, find, nearest, neo_hooke, ramp, sliding

cook = find("cook")
THICKNESS, HEIGHT = 2.0, 44.0  # of the panel, and of its clamped side [mm]
SMALL = 1e-5  # fraction of the load at which the response is linear; second-order terms are about 1e-5 of the response
RESIDUAL = 1e-5  # at the full load of about 100 N [N, mm3]
LOCKED = 0.5  # the panel locks if its tip reaches less than this fraction of the true displacement


def _place(unit: Floats) -> Floats:
    """Map points (n, 3) of the unit cube to the panel [mm], with smaller cells near its sides to resolve the clamped corners."""
    x, y = (3 * unit[:, :2] ** 2 - 2 * unit[:, :2] ** 3).T
    weights = np.stack([(1 - x) * (1 - y), x * (1 - y), x * y, (1 - x) * y], axis=1)
    return np.column_stack([weights @ np.array(cook.CORNERS), THICKNESS * unit[:, 2]])


@dataclass(frozen=True)
class Panel:
    """The membrane ``name`` of ``validation.cook`` with an ``element``, under the fraction ``share`` of its load. Its moduli are
    multiplied by ``shear`` and ``bulk`` (1: the true values).
    """

    name: str
    element: str
    share: float = 1.0
    shear: float = 1.0
    bulk: float = 1.0

    def body(self, n: int) -> Body:
        """The panel in n by n cells."""
        membrane = getattr(cook, self.name)
        faces = {face: face for face in ("x0", "x1", "z0", "z1")}
        mesh = shapes.mapped([shapes.Brick(_place, (n, n, 1), faces)], ELEMENTS[self.element][0], 1)
        pull = make("traction", on="x1", force=f"0, {membrane.traction * self.share}, 0 MPa", ramp=ramp())
        acting = *neo_hooke(membrane.shear * self.shear, membrane.bulk * self.bulk, self.element), pull
        return Body(mesh, acting, (*clamped("x0"), *sliding("z0", "z1")), (0.0, 1.0))


def tip(lab: Lab, n: int, **panel: Any) -> float:
    """The displacement [mm] along y of the corner (48, 60) of a :class:`Panel` in n by n cells, divided by the load fraction."""
    made = Panel(**panel)
    body, first = made.body(n), 0.25 if made.share == 1 else 1.0
    state = lab.solve(body, made.element, first_step=first, residual=RESIDUAL * made.share).last
    corner = nearest(body.mesh.points, (48.0, 60.0, 0.0))
    return float(state.points[corner, 1] - body.mesh.points[corner, 1]) / made.share


def ratio(lab: Lab, n: int, **panel: Any) -> float:
    """The displacement of the corner, divided by its true value."""
    return tip(lab, n, **panel) / float(getattr(cook, panel["name"]).tip)


COMPRESSIBLE = {"name": "COMPRESSIBLE", "share": SMALL}
NEARLY = {"name": "NEARLY_INCOMPRESSIBLE", "share": SMALL}
QUARTER, FULL = {"name": "FINITE_QUARTER"}, {"name": "FINITE"}
MEMBRANES = {
    "COMPRESSIBLE": "at small strain, Poisson's ratio 1/3",
    "NEARLY_INCOMPRESSIBLE": "at small strain, Poisson's ratio 0.4999",
    "FINITE_QUARTER": "at finite strain, a quarter of the load",
    "FINITE": "at finite strain, the full load",
}
# For each element: the cells in words, and the numbers of cells along a side. The singular clamped corners limit quadratic cells to
# order 1 or a little more; linear cells, whose error is far larger, converge at order 2.
CELLS = {
    "P1": ("linear tetrahedra", (16, 32, 64)),
    "P1/P1": ("linear tetrahedra with a stabilised linear pressure", (8, 16, 32)),
    "Q1/P0": ("linear hexahedra with a constant pressure", (8, 16, 32)),
    "P2": ("quadratic tetrahedra", (4, 8, 16)),
    "P2/P1": ("quadratic tetrahedra with a pressure", (4, 8, 16)),
    "Q2/Q1": ("quadratic hexahedra with a linear pressure", (4, 8, 16)),
}
SOURCE = "validation/cook.py: our own finite elements of degree 6 to 10 in numpy, on graded meshes; Cook 1974"
MEMBRANE = partial(Entry, group="Cook's membrane", kind="second solver", source=SOURCE)
LINEAR = control("linear tetrahedra without a pressure", element="P1")
LINEAR_HEXAHEDRA = control("linear hexahedra without a pressure", element="Q1")
SOFTER = control("Poisson's ratio is 0.4 instead of 1/3, at the same Young's modulus", shear=4 / 3 / 1.4, bulk=5 / 3)
LOCKING = control("Poisson's ratio is 0.4999, at the same Young's modulus: it locks", **NEARLY)
STIFF = control("the shear modulus is 2 % too high", shear=1.02)
SMALL_STRAIN = control("small strain, linearly extrapolated from a tiny load", share=SMALL)


def tip_entry(
    name: str, panel: dict[str, Any], element: str, wrong: dict[str, Any], stiff: tuple[float, str], **more: Any
) -> Entry:
    """The entry for the tip of a ``panel`` with an ``element``; ``stiff``: the tolerance, and the excess stiffness, in words."""
    words, counts = CELLS[element]
    by, order = ("with linear cells", 2) if "1" in element[:2] else ("limited by the singular clamped corners", 1)
    stated = {"refinement": Refinement(counts, HEIGHT, order)} | wrong | more
    return MEMBRANE(
        name=f"cook_{name}",
        title=f"Cook's membrane {MEMBRANES[panel['name']]}: tip with {words}",
        unit="mm",
        measure=tip,
        given={**panel, "element": element},
        truth=getattr(cook, panel["name"]).tip,
        within=stiff[0],
        relative=True,
        because=f"discretisation error, {by}: too stiff by {stiff[1]}",
        **stated,
    )


SHORT = Refinement((4, 8), HEIGHT, order=1)
LEFT_OPEN = "0.06 %; a clamped corner folds on fine meshes, so the true value is uncertain by 0.02 %"

ENTRIES: tuple[Entry, ...] = (
    tip_entry("compressible", COMPRESSIBLE, "P2", SOFTER, (0.005, "0.15 %")),
    tip_entry("compressible_linear", COMPRESSIBLE, "P1", LOCKING, (0.04, "1.3 %"), slow=True),
    tip_entry("nearly_incompressible", NEARLY, "P2/P1", LINEAR, (0.005, "0.16 %")),
    tip_entry("hexahedra", NEARLY, "Q2/Q1", STIFF, (0.001, "0.02 %"), slow=True),
    tip_entry("constant_pressure", NEARLY, "Q1/P0", LINEAR_HEXAHEDRA, (0.015, "0.5 %")),
    tip_entry(
        "stabilised", NEARLY, "P1/P1", LINEAR, (0.04, "22, 7.7 and 2.2 % with 8, 16 and 32 cells along each side")
    ),
    tip_entry("quarter_load", QUARTER, "P2/P1", SMALL_STRAIN, (0.005, "0.17 %"), slow=True),
    tip_entry("quarter_load_hexahedra", QUARTER, "Q2/Q1", STIFF, (0.001, "0.02 %"), **SLOW),
    tip_entry("full_load", FULL, "Q2/Q1", SMALL_STRAIN, (0.002, LEFT_OPEN), slow=True, refinement=SHORT),
    MEMBRANE(
        name="cook_p1_locks",
        title="Linear tetrahedra lock at Poisson's ratio 0.4999: the tip reaches less than half of its true displacement",
        unit="",
        measure=ratio,
        given={**NEARLY, "n": 8, "element": "P1"},
        **control("quadratic tetrahedra with a pressure", element="P2/P1"),
        truth=LOCKED / 2,
        within=LOCKED / 2,
        because="the element is taken to be locked below half of the displacement: any ratio from 0 to 0.5 passes",
        kind="property",
        source="true displacement of the tip: " + SOURCE,
    ),
    MEMBRANE(
        name="cook_taylor_hood",
        title="Taylor-Hood tetrahedra do not lock where linear tetrahedra do: ratio of tip displacement to true value",
        unit="",
        measure=ratio,
        given={**NEARLY, "n": 8, "element": "P2/P1"},
        **LINEAR,
        truth=1.0,
        within=0.01,
        because="discretisation error: too stiff by 0.8 % in 8 by 8 cells",
    ),
)
