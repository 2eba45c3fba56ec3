"""Weights, pressures and dead forces on blocks."""

from dataclasses import replace

import numpy as np

from fem_reference.assessment.catalogue import Entry, Finding, Lab, order
from fem_reference.effects import Effect, make
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Cells, Prescribed
from fem_reference.problems.paths import Rest, Turn
from fem_reference.verification import truths
from fem_reference.verification.homogeneous import (
    BULK,
    MU,
    NEO,
    SIZE,
    STEPS,
    Specimen,
    stretch_entry,
)
from fem_reference.verification.parts import SYMMETRY, ramp, resistance, zero

GROUP = "loads"
MUSCLE, FAT = 1.06e-9, 0.92e-9  # densities [tonne/mm3]
FREE_FALL = 9810.0  # mm/s2
FIXED = (Prescribed("z0", "z0", (0, 1, 2), Rest()),)


def weight(density: float, times: float = 1.0) -> Effect:
    """Gravity along -z, ``times`` that of the earth, on ``density`` [tonne/mm3]."""
    pull = f"0, 0, {-FREE_FALL * times} mm/s^2"
    return make("gravity", density=f"{density} tonne/mm^3", acceleration=pull, ramp=ramp())


def wet(mesh: Cells, faces: tuple[str, ...]) -> Cells:
    """``mesh`` with a region "wet" of some of its faces."""
    return replace(mesh, facets=mesh.facets | {"wet": np.concatenate([mesh.facets[face] for face in faces])})


def pressed(pressure: float) -> Effect:
    """A fluid of ``pressure`` [MPa] on what is wet."""
    return make("pressure", on="wet", pressure=f"{pressure} MPa", ramp=ramp())


def dead(nominal: float) -> Effect:
    """A force per area at rest along x on the face x1 [MPa]."""
    return make("traction", on="x1", force=f"{nominal}, 0, 0 MPa", ramp=ramp())


# The weight of a standing block.
_LARGE = (100.0, 50.0, 60.0)


def _reaction(density: float, lab: Lab) -> Finding:
    """Of a block of muscle of 300 ml that stands, stuck to its base [N]."""
    mesh = shapes.box((3, 2, 2), _LARGE, "tetrahedron")
    acting = (*NEO.effects, resistance("P2/P1", BULK), weight(density))
    last = lab.solve(Body(mesh, acting, FIXED, (0, 1)), "P2/P1", first_step=0.25, residual=1e-10).last
    return Finding(float(last.forces["z0"][2]))


_STANDING = Entry(
    name="standing_weight",
    group=GROUP,
    title="Block of muscle that stands and sags: force on its base",
    unit="N",
    truth=lambda: MUSCLE * FREE_FALL * float(np.prod(_LARGE)),
    within=2e-9,
    relative=False,
    because="The forces of a discrete equilibrium sum to zero whatever the mesh, but for the residual: it is 1e-10 N as a root of "
    "a sum of squares over 150 free nodes, and the sum of all may be the root of 150 times as large.",
    kind="closed form",
    source="Density times acceleration times volume.",
    measure=lambda lab: _reaction(MUSCLE, lab),
    negative_control="The density of fat instead of muscle.",
    with_negative_control=lambda lab: _reaction(FAT, lab),
)

# A soft column in a box that sinks under its own weight by a tenth of its height.
_HEIGHT, _SOFT, _WEIGHT = 10.0, 5 * MU, 1e-3  # mm, MPa, N/mm3


def _top(element: str, cells: int, lab: Lab) -> float:
    """Displacement of the top of the column [mm], by a number of cells one above the other."""
    mesh = shapes.box((1, 1, cells), (2.0, 2.0, _HEIGHT), ELEMENTS[element][0])
    walls = (Prescribed(face, face, ("xyz".index(face[0]),), Rest()) for face in ("x0", "x1", "y0", "y1", "z0"))
    acting = (*NEO.effects, resistance(element, _SOFT), weight(MUSCLE, _WEIGHT / (MUSCLE * FREE_FALL)))
    return (
        float(lab.solve(Body(mesh, acting, tuple(walls), (0, 1)), element, **STEPS).last.points[:, 2].max()) - _HEIGHT
    )


def _known_top() -> float:
    return float(truths.find("loads").column_top(MU, _SOFT, _WEIGHT, _HEIGHT))


def _column(element: str, lab: Lab) -> Finding:
    """On a ladder of meshes."""
    ladder = tuple((_HEIGHT / cells, _top(element, cells, lab)) for cells in (2, 4, 8))
    return Finding(ladder[-1][1], order(ladder, _known_top()), ladder)


_COLUMN = Entry(
    name="heavy_column",
    group=GROUP,
    title="Soft column in a smooth box that sinks under its own weight, by Q2: displacement of its top",
    unit="mm",
    truth=_known_top,
    within=1e-8,
    relative=True,
    because="Discretisation: the top of 8 cells converges at twice the degree of the element, order 4.",
    kind="closed form",
    source="validation/loads.py, column_top: balance integrated by hand",
    measure=lambda lab: _column("Q2", lab),
    negative_control="Linear instead of quadratic elements (Q1).",
    with_negative_control=lambda lab: _column("Q1", lab),
)

# A block in a fluid, free to shrink on its planes of symmetry.
_FLUID, _COMPRESSIBLE = 0.1, 1.0  # MPa


def _shrunk(load: Effect, lab: Lab) -> Finding:
    """V/V0 of a block under a ``load`` on what is wet."""
    mesh = wet(shapes.box((2, 2, 2), SIZE, "tetrahedron"), ("x1", "y1", "z1"))
    acting = (*NEO.effects, resistance("P2/P1", _COMPRESSIBLE), load)
    return Finding(lab.solve(Body(mesh, acting, SYMMETRY, (0, 1)), "P2/P1", **STEPS).last.scalars["volume_ratio"])


_HYDROSTATIC = Entry(
    name="pressed_volume",
    group=GROUP,
    title="Block in a fluid whose pressure is a tenth of its bulk modulus: volume over that at rest",
    unit="1",
    truth=lambda: float(truths.find("loads").pressed_volume(_COMPRESSIBLE, _FLUID)),
    within=1e-12,
    relative=True,
    because="The element has the exact answer, but for the residual: 1e-13 N may add up over the 100 nodes to 10 times as much, "
    "and a pressure of this over a face of 3 mm2 changes the volume by 3e-13.",
    kind="closed form",
    source="validation/loads.py, pressed_volume",
    measure=lambda lab: _shrunk(pressed(_FLUID), lab),
    negative_control="The fluid's pressure 1 % too high.",
    with_negative_control=lambda lab: _shrunk(pressed(1.01 * _FLUID), lab),
)

_ALL = ("x0", "x1", "y0", "y1", "z0", "z1")
_TILT = Prescribed("z1", "z1", (0, 1, 2), Turn((0.0, 1.0, 0.0), 0.3, (SIZE[0] / 2, SIZE[1] / 2, SIZE[2])))


def _left_over(faces: tuple[str, ...], lab: Lab) -> Finding:
    """The sum of the forces [N] on both ends of a block, its top tilted by 0.3 rad, in a fluid that wets ``faces``."""
    mesh = wet(shapes.box((2, 2, 2), SIZE, "tetrahedron"), faces)
    acting = (*NEO.effects, resistance("P2/P1", BULK), pressed(2 * MU))
    forces = lab.solve(Body(mesh, acting, (*FIXED, _TILT), (0, 1)), "P2/P1", **STEPS).last.forces
    return Finding(float(np.linalg.norm(forces["z0"] + forces["z1"])))


_CLOSED = Entry(
    name="pressure_all_round",
    group=GROUP,
    title="Tilted block in a fluid that presses all round: what its two holders carry together",
    unit="N",
    truth=zero,
    within=1e-12,
    relative=False,
    because="A pressure on a closed surface has no resultant, on a discrete one either, but for the residual: 1e-13 N may add up "
    "over 75 free nodes to 9 times as much.",
    kind="property",
    source="The divergence of the cofactor of F vanishes (Piola; Holzapfel 2000, ch. 2.4).",
    measure=lambda lab: _left_over(_ALL, lab),
    negative_control="The top is dry.",
    with_negative_control=lambda lab: _left_over(_ALL[:-1], lab),
)

_QUARTER = Turn((0.0, 1.0, 0.0), np.pi / 2, knots=((1.0, 0.0), (2.0, 1.0)))


def _turned(load: Effect, lab: Lab) -> Finding:
    """A block leans under a ``load``, then its base is turned by a quarter circle: how far it is from itself turned [mm]."""
    mesh = wet(shapes.box((2, 2, 2), SIZE, "tetrahedron"), ("x1",))
    base = (Prescribed("z0", "z0", (0, 1, 2), _QUARTER),)
    acting = (*NEO.effects, resistance("P2/P1", BULK), load)
    solved = lab.solve(Body(mesh, acting, base, (0, 1, 2)), "P2/P1", **STEPS)
    after, before = solved.last.points, solved.states[1].points
    return Finding(float(np.linalg.norm(after - before - _QUARTER(before, 2), axis=1).max()))


_FOLLOWER = Entry(
    name="pressure_turns",
    group=GROUP,
    title="Block that leans under a pressure on one side, turned by a quarter circle: largest difference to itself turned",
    unit="mm",
    truth=zero,
    within=1e-10,
    relative=False,
    because="A pressure turns with the surface, but for the residual: 1e-13 N may add up to 1e-12 N, and the block that stands "
    "bends under a force at its top by 1 mm for every 0.05 N: 2e-11 mm, before the turn and after.",
    kind="property",
    source="Objectivity: Nanson's formula turns with F.",
    measure=lambda lab: _turned(pressed(0.2 * MU), lab),
    negative_control="A dead load of the same size.",
    with_negative_control=lambda lab: _turned(dead(-0.2 * MU), lab),
)


def _dead_pull() -> Entry:
    pulled = Specimen(NEO, "P2/P1", "pulled", MU, loads=(dead(MU),))
    follower = make("pressure", on="x1", pressure=f"{-MU} MPa", ramp=ramp())
    control = "The force spread over the area as it is now.", replace(pulled, loads=(follower,))
    return stretch_entry(GROUP, "dead_pull", "Block pulled by a dead force: how far it stretches", 0, pulled, control)


ENTRIES = (_STANDING, _COLUMN, _HYDROSTATIC, _CLOSED, _FOLLOWER, _dead_pull())
