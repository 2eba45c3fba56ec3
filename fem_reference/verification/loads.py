"""Weights, pressures and dead loads on blocks."""

from dataclasses import replace
from functools import partial

import numpy as np

from fem_reference.assessment.catalogue import Entry, Lab, Refinement
from fem_reference.effects import Effect, make
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import Turn
from fem_reference.runs.store import Run
from fem_reference.verification import parts
from fem_reference.verification.homogeneous import BULK, MU, NEO, SIZE, STEPS, Specimen, stretch_entry

loads = parts.find("loads")
MUSCLE, FAT = 1.06e-9, 0.92e-9  # densities [tonne/mm3]
FREE_FALL = 9810.0  # mm/s2
LARGE = (100.0, 50.0, 60.0)  # sides [mm] of a block of muscle, whose volume is 300 ml
# Height of a soft column [mm], its bulk modulus [MPa] and its weight [N/mm3], under which it sinks by a tenth of its height.
HEIGHT, SOFT, WEIGHT = 10.0, 5 * MU, 1e-3
FLUID, COMPRESSIBLE = 0.1, 1.0  # a pressure, and the bulk modulus of the block that it shrinks [MPa]
TILT = Turn((0.0, 1.0, 0.0), 0.3, (SIZE[0] / 2, SIZE[1] / 2, SIZE[2]))
QUARTER = Turn((0.0, 1.0, 0.0), np.pi / 2, knots=((1.0, 0.0), (2.0, 1.0)))


def weight(density: float, times: float = 1.0) -> Effect:
    """Gravity along -z on a material of ``density`` [tonne/mm3], ``times`` as strong as on earth."""
    pull = f"0, 0, {-FREE_FALL * times} mm/s^2"
    return make("gravity", density=f"{density} tonne/mm^3", acceleration=pull, ramp=parts.ramp())


def pressed(pressure: float) -> Effect:
    """A fluid of ``pressure`` [MPa] on the region "wet"."""
    return make("pressure", on="wet", pressure=f"{pressure} MPa", ramp=parts.ramp())


def dead(nominal: float) -> Effect:
    """A force per unit rest area [MPa] along x on the face x1."""
    return make("traction", on="x1", force=f"{nominal}, 0, 0 MPa", ramp=parts.ramp())


def loaded(
    lab: Lab,
    wet: tuple[str, ...],
    load: Effect,
    prescribed: tuple[Prescribed, ...],
    frames: int = 1,
    bulk: float = BULK,
) -> Run:
    """The states of a block, some of whose faces are ``wet``, under a ``load`` over a number of ``frames``."""
    mesh = shapes.box((2, 2, 2), SIZE, "tetrahedron")
    mesh = replace(mesh, facets=mesh.facets | {"wet": np.concatenate([mesh.facets[face] for face in wet])})
    body = Body(mesh, (*parts.neo_hooke(MU, bulk), load), prescribed, tuple(range(frames + 1)))
    return lab.solve(body, "P2/P1", **STEPS)


def reaction(lab: Lab, density: float) -> float:
    """The force [N] on the base to which a standing block is glued."""
    mesh = shapes.box((3, 2, 2), LARGE, "tetrahedron")
    body = Body(mesh, (*parts.neo_hooke(MU, BULK), weight(density)), parts.clamped("z0"), (0, 1))
    return float(lab.solve(body, "P2/P1", first_step=0.25, residual=1e-10).last.forces["z0"][2])


def top(lab: Lab, cells: int, element: str) -> float:
    """The displacement [mm] of the top of the column, with a number of ``cells`` along its height."""
    mesh = shapes.box((1, 1, cells), (2.0, 2.0, HEIGHT), ELEMENTS[element][0])
    acting = (*parts.neo_hooke(MU, SOFT, element), weight(MUSCLE, WEIGHT / (MUSCLE * FREE_FALL)))
    body = Body(mesh, acting, parts.sliding("x0", "x1", "y0", "y1", "z0"), (0, 1))
    return float(lab.solve(body, element, **STEPS).last.points[:, 2].max()) - HEIGHT


def shrunk(lab: Lab, pressure: float) -> float:
    """V/V0 of a block in a fluid of ``pressure`` [MPa]. The block slides on its planes of symmetry."""
    solved = loaded(lab, ("x1", "y1", "z1"), pressed(pressure), parts.SYMMETRY, bulk=COMPRESSIBLE)
    return solved.last.scalars["volume_ratio"]


def left_over(lab: Lab, faces: tuple[str, ...]) -> float:
    """The magnitude [N] of the total force on both ends of a block in a fluid that wets ``faces``; its top is tilted by 0.3 rad."""
    ends = (*parts.clamped("z0"), Prescribed("z1", "z1", (0, 1, 2), TILT))
    forces = loaded(lab, faces, pressed(2 * MU), ends).last.forces
    return float(np.linalg.norm(forces["z0"] + forces["z1"]))


def turned(lab: Lab, load: Effect) -> float:
    """The largest error [mm] of a nodal position after the base of a block leaning under a ``load`` is rotated by 90 degrees."""
    solved = loaded(lab, ("x1",), load, (Prescribed("z0", "z0", (0, 1, 2), QUARTER),), frames=2)
    before = solved.states[1].points
    return parts.farthest(solved.last.points, before + QUARTER(before, 2))


LOAD = partial(Entry, group="loads")
PULLED = Specimen(NEO, "P2/P1", "pulled", MU, loads=(dead(MU),))

ENTRIES: tuple[Entry, ...] = (
    LOAD(
        name="standing_weight",
        title="Block of muscle that stands and sags: force on its base",
        unit="N",
        measure=reaction,
        given={"density": MUSCLE},
        **parts.control("The density of fat instead of muscle.", density=FAT),
        truth=MUSCLE * FREE_FALL * float(np.prod(LARGE)),
        within=2e-9,
        because="The forces of a discrete equilibrium sum to zero on every mesh, up to the residual: over 150 free nodes its norm "
        "is 1e-10 N, so its sum may be sqrt(150) times as large.",
        kind="closed form",
        source="Density times acceleration times volume.",
    ),
    LOAD(
        name="heavy_column",
        title="Soft column in a frictionless box that sinks under its own weight, with Q2: displacement of its top",
        unit="mm",
        measure=top,
        given={"element": "Q2"},
        **parts.control("Linear instead of quadratic elements (Q1).", element="Q1"),
        truth=lambda: loads.column_top(MU, SOFT, WEIGHT, HEIGHT),
        within=1e-8,
        relative=True,
        because="Discretisation error with 8 cells; the top converges at twice the degree of the element, order 4.",
        kind="closed form",
        source="validation/loads.py, column_top: balance integrated by hand",
        refinement=Refinement((2, 4, 8), HEIGHT, order=4),
    ),
    LOAD(
        name="pressed_volume",
        title="Block in a fluid whose pressure is a tenth of the block's bulk modulus: ratio of volume to rest volume",
        unit="1",
        measure=shrunk,
        given={"pressure": FLUID},
        **parts.control("The fluid's pressure 1 % too high.", pressure=1.01 * FLUID),
        truth=lambda: loads.pressed_volume(COMPRESSIBLE, FLUID),
        within=1e-12,
        relative=True,
        because="The element represents the exact solution, up to the residual: 1e-13 N may add up to 1e-12 N over 100 nodes, and "
        "as a pressure on a face of 3 mm2 this changes the volume by 3e-13.",
        kind="closed form",
        source="validation/loads.py, pressed_volume",
    ),
    LOAD(
        name="pressure_all_round",
        title="Tilted block in a fluid that presses on all sides: the sum of the forces on both ends",
        unit="N",
        measure=left_over,
        given={"faces": parts.SURFACE},
        **parts.control("The top is dry.", faces=parts.SURFACE[:-1]),
        truth=0.0,
        within=1e-12,
        because="A pressure on a closed surface, discrete or not, has no resultant, up to the residual: 1e-13 N may add up to "
        "9e-13 N over 75 free nodes.",
        kind="property",
        source="The divergence of the cofactor of F vanishes (Piola; Holzapfel 2000, ch. 2.4).",
    ),
    LOAD(
        name="pressure_turns",
        title="Block that leans under a pressure on one side, then turned by 90 degrees: largest error of a nodal position",
        unit="mm",
        measure=turned,
        given={"load": pressed(0.2 * MU)},
        **parts.control("A dead load of the same size.", load=dead(-0.2 * MU)),
        truth=0.0,
        within=1e-10,
        because="A pressure turns with the surface, up to the residual: 1e-13 N may add up to 1e-12 N, which bends the block (0.05 "
        "N/mm for a force at its top) by 2e-11 mm before the turn and after.",
        kind="property",
        source="Objectivity: Nanson's formula turns with F.",
    ),
    stretch_entry(
        0,
        "loads",
        "dead_pull",
        "Block pulled by a dead load: its stretch",
        PULLED,
        "The load is a force per current instead of rest area.",
        loads=(make("pressure", on="x1", pressure=f"{-MU} MPa", ramp=parts.ramp()),),
    ),
)
