"""Cook's membrane: a clamped, tapered panel in plane strain, under a shear load; nearly incompressible, bent and sheared at once.

One layer of cells, both of whose faces stay in their planes. The small strain solution is found by a load so small that it is
linear, and scaled up.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from fem_reference.assessment.catalogue import Entry, Finding, Lab
from fem_reference.effects import make
from fem_reference.foundations.mesh import Floats
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import Rest
from fem_reference.verification.parts import ladder, once, ramp, resistance
from fem_reference.verification.truths import find

GROUP = "Cook's membrane"
THICKNESS, HEIGHT = 2.0, 44.0  # of the panel, and of its clamped side [mm]
SMALL = 1e-5  # the share of the load at which the answer is linear: terms of second order are some 1e-5 of it
RESIDUAL = 1e-5  # at the whole load [N, mm3], where some 100 N act
LOCKED = 0.5  # a tip that gets less than this share of its displacement is locked
FIXED = (
    Prescribed("clamp", "x0", (0, 1, 2), Rest()),
    Prescribed("z0", "z0", (2,), Rest()),
    Prescribed("z1", "z1", (2,), Rest()),
)


def _place(unit: Floats) -> Floats:
    """Points (n, 3) [mm] of the panel from those of the unit cube, crowded towards its four sides: the clamped corners need it."""
    x, y = (3 * unit[:, :2] ** 2 - 2 * unit[:, :2] ** 3).T
    weights = np.stack([(1 - x) * (1 - y), x * (1 - y), x * y, (1 - x) * y], axis=1)
    return np.column_stack([weights @ np.array(find("cook").CORNERS), THICKNESS * unit[:, 2]])


@dataclass(frozen=True)
class Panel:
    """The membrane ``name`` of ``validation.cook`` made of an ``element``, under a ``share`` of its load; its moduli are off by the
    factors ``shear`` and ``bulk``.
    """

    name: str
    element: str
    share: float = 1.0
    shear: float = 1.0
    bulk: float = 1.0

    @property
    def membrane(self) -> Any:
        """Its data and its truth."""
        return getattr(find("cook"), self.name)

    def true_tip(self) -> float:
        """How far the corner (48, 60) goes along y [mm]."""
        return float(self.membrane.tip)

    def body(self, n: int) -> Body:
        """The panel in n by n cells."""
        faces = {face: face for face in ("x0", "x1", "z0", "z1")}
        mesh = shapes.mapped([shapes.Block(_place, (n, n, 1), faces)], ELEMENTS[self.element][0], 1)
        pull = f"0, {self.membrane.traction * self.share}, 0 MPa"
        acting = (
            make("neo_hooke", mu=f"{self.membrane.shear * self.shear} MPa"),
            resistance(self.element, self.membrane.bulk * self.bulk),
            make("traction", on="x1", force=pull, ramp=ramp()),
        )
        return Body(mesh, acting, FIXED, (0.0, 1.0))

    def tip(self, lab: Lab, n: int) -> float:
        """How far the corner goes in n by n cells [mm], over ``share``."""
        body, first = self.body(n), 0.25 if self.share == 1 else 1.0
        state = lab.solve(body, self.element, first_step=first, residual=RESIDUAL * self.share).last
        corner = np.argmin(np.linalg.norm(body.mesh.points - [48.0, 60.0, 0.0], axis=1))
        return float(state.points[corner, 1] - body.mesh.points[corner, 1]) / self.share

    def ladder(self, lab: Lab, counts: tuple[int, ...]) -> Finding:
        """The tip on meshes that get finer."""
        return ladder(lab, self.tip, counts, HEIGHT, self.true_tip)

    def ratio(self, lab: Lab, n: int) -> Finding:
        """The tip over where it should be."""
        return Finding(self.tip(lab, n) / self.true_tip())


def _tip_entry(name: str, title: str, panel: Panel, counts: tuple[int, ...], within: float, **fields: Any) -> Entry:
    """An entry whose value is the tip; ``fields`` has ``because``, ``negative_control`` and ``with_negative_control``."""
    return Entry(
        name=name,
        group=GROUP,
        title=title,
        unit="mm",
        truth=panel.true_tip,
        within=within,
        relative=True,
        kind="second solver",
        source=SOURCE,
        measure=partial(panel.ladder, counts=counts),
        **fields,
    )


def _with_negative_control(panel: Panel, n: int) -> Callable[[Lab], Finding]:
    return partial(once, value=panel.tip, count=n)


SOURCE = "validation/cook.py: finite elements of degree 6 to 10 of our own in numpy, on graded grids; Cook 1974"
_QUARTER_TETRAHEDRA = Panel("FINITE_QUARTER", "P2/P1")
_QUARTER_HEXAHEDRA = Panel("FINITE_QUARTER", "Q2/Q1")
_FULL = Panel("FINITE", "Q2/Q1")
_COMPRESSIBLE = Panel("COMPRESSIBLE", "P2", SMALL)
_COMPRESSIBLE_LINEAR = Panel("COMPRESSIBLE", "P1", SMALL)
_NEARLY = Panel("NEARLY_INCOMPRESSIBLE", "P2/P1", SMALL)
_NEARLY_HEXAHEDRA = Panel("NEARLY_INCOMPRESSIBLE", "Q2/Q1", SMALL)
_NEARLY_CONSTANT = Panel("NEARLY_INCOMPRESSIBLE", "Q1/P0", SMALL)
_NEARLY_LINEAR = Panel("NEARLY_INCOMPRESSIBLE", "P1", SMALL)
_NEARLY_STABILISED = Panel("NEARLY_INCOMPRESSIBLE", "P1/P1", SMALL)
_STIFF = "the shear modulus is 2 % too high"

ENTRIES = (
    _tip_entry(
        "cook_compressible",
        "Cook's membrane at small strain, Poisson's ratio 1/3: tip by quadratic tetrahedra",
        _COMPRESSIBLE,
        (4, 8, 16),
        0.005,
        because="discretisation, limited by the singular clamped corners: 0.15 % too stiff",
        negative_control="Poisson's ratio is 0.4 instead of 1/3, at the same Young's modulus",
        with_negative_control=_with_negative_control(
            Panel("COMPRESSIBLE", "P2", SMALL, shear=1.4**-1 * 4 / 3, bulk=5 / 3), 16
        ),
    ),
    _tip_entry(
        "cook_compressible_linear",
        "The same by linear tetrahedra, which come slowly but surely where nothing is incompressible",
        _COMPRESSIBLE_LINEAR,
        (16, 32, 64),
        0.04,
        because="discretisation by linear cells",
        negative_control="Poisson's ratio is 0.4999, at the same Young's modulus: it locks",
        with_negative_control=_with_negative_control(_NEARLY_LINEAR, 64),
        slow=True,
    ),
    _tip_entry(
        "cook_nearly_incompressible",
        "Cook's membrane at small strain, Poisson's ratio 0.4999: tip by quadratic tetrahedra with a pressure",
        _NEARLY,
        (4, 8, 16),
        0.005,
        because="discretisation, limited by the singular clamped corners: 0.16 % too stiff",
        negative_control="linear tetrahedra without a pressure",
        with_negative_control=_with_negative_control(_NEARLY_LINEAR, 16),
    ),
    _tip_entry(
        "cook_hexahedra",
        "The same by quadratic hexahedra with a linear pressure",
        _NEARLY_HEXAHEDRA,
        (4, 8, 16),
        0.001,
        because="discretisation: 0.02 % too stiff",
        negative_control=_STIFF,
        with_negative_control=_with_negative_control(Panel("NEARLY_INCOMPRESSIBLE", "Q2/Q1", SMALL, shear=1.02), 16),
        slow=True,
    ),
    _tip_entry(
        "cook_constant_pressure",
        "The same by linear hexahedra with a constant pressure",
        _NEARLY_CONSTANT,
        (8, 16, 32),
        0.015,
        because="discretisation by linear cells: 0.5 % too stiff",
        negative_control="linear hexahedra without a pressure",
        with_negative_control=_with_negative_control(Panel("NEARLY_INCOMPRESSIBLE", "Q1", SMALL), 32),
    ),
    _tip_entry(
        "cook_stabilised",
        "The same by linear tetrahedra with a linear pressure that is stabilised",
        _NEARLY_STABILISED,
        (8, 16, 32),
        0.04,
        because="discretisation by linear cells: 22, 7.7 and 2.2 % too stiff in 8, 16 and 32 cells a side",
        negative_control="linear tetrahedra without a pressure",
        with_negative_control=_with_negative_control(_NEARLY_LINEAR, 32),
    ),
    _tip_entry(
        "cook_quarter_load",
        "Cook's membrane at finite strain, a quarter of the load: tip by quadratic tetrahedra with a pressure",
        _QUARTER_TETRAHEDRA,
        (4, 8, 16),
        0.005,
        because="discretisation, limited by the singular clamped corners: 0.17 % too stiff",
        negative_control="small strain, by linear extrapolation of a tiny load",
        with_negative_control=_with_negative_control(Panel("FINITE_QUARTER", "P2/P1", SMALL), 16),
        slow=True,
    ),
    _tip_entry(
        "cook_quarter_load_hexahedra",
        "The same by quadratic hexahedra with a linear pressure",
        _QUARTER_HEXAHEDRA,
        (4, 8, 16),
        0.001,
        because="discretisation: 0.02 % too stiff",
        negative_control=_STIFF,
        with_negative_control=_with_negative_control(Panel("FINITE_QUARTER", "Q2/Q1", shear=1.02), 16),
        slow=True,
        slow_negative_control=True,
    ),
    _tip_entry(
        "cook_full_load",
        "Cook's membrane at finite strain, the whole load: tip by quadratic hexahedra with a linear pressure",
        _FULL,
        (4, 8),
        0.002,
        because="discretisation (0.06 % too stiff) and 0.02 % that the truth leaves open: a clamped corner folds on fine meshes",
        negative_control="small strain, by linear extrapolation of a tiny load",
        with_negative_control=_with_negative_control(Panel("FINITE", "Q2/Q1", SMALL), 8),
        slow=True,
    ),
    Entry(
        name="cook_p1_locks",
        group=GROUP,
        title="Linear tetrahedra lock at Poisson's ratio 0.4999: tip over where it should be, less than a half",
        unit="",
        truth=lambda: LOCKED / 2,
        within=LOCKED / 2,
        relative=False,
        because="the band is all from 0 to 0.5: less than half of the displacement is called locked; how much less is no truth",
        kind="property",
        source="where the tip should be: " + SOURCE,
        measure=partial(_NEARLY_LINEAR.ratio, n=8),
        negative_control="quadratic tetrahedra with a pressure",
        with_negative_control=partial(_NEARLY.ratio, n=8),
    ),
    Entry(
        name="cook_taylor_hood",
        group=GROUP,
        title="On the mesh where linear tetrahedra lock, those of Taylor and Hood do not: tip over where it should be",
        unit="",
        truth=lambda: 1.0,
        within=0.01,
        relative=False,
        because="discretisation: 0.8 % too stiff in 8 by 8 cells",
        kind="second solver",
        source=SOURCE,
        measure=partial(_NEARLY.ratio, n=8),
        negative_control="linear tetrahedra without a pressure",
        with_negative_control=partial(_NEARLY_LINEAR.ratio, n=8),
    ),
)
