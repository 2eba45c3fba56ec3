"""Order of convergence at the rim of a clamped area, near which the displacement varies as the square root of the distance.

Half of the bottom of a block is clamped, so that a clamped and a free face meet at 180 degrees. The side beyond the free half
is pulled along the bottom, by a load so small that strains are about a hundredth. The opposite side slides on a plane, so that its
corner with the clamped half is not singular.
"""

from functools import partial

import numpy as np

from fem_reference.assessment.catalogue import Entry, Finding, Lab
from fem_reference.effects import make
from fem_reference.foundations.mesh import Floats
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Cells
from fem_reference.verification.parts import clamped, control, find, neo_hooke, ramp, sliding

ELEMENT = "Q2/Q1"
MU, BULK = 0.01, 10.0  # [MPa]
LOAD = 1e-4  # [MPa]
UNIFORM, GRADED = 1.0, 0.5  # the exponent m of cell sizes h ~ r^(1 - m), r from the rim; 1 is not graded


def _side(sign: float, depth: float, grading: float, unit: Floats) -> Floats:
    """Points (n, 3) [mm] of half the block from those of the unit cube, finer near the rim x = z = 0 if ``grading`` < 1."""
    x = unit[:, 0] if sign > 0 else 1 - unit[:, 0]
    power = 1 / grading
    return np.column_stack([sign * x**power, depth * unit[:, 1], unit[:, 2] ** power])


def _halves(counts: shapes.Counts, grading: float) -> Cells:
    """The block from (-1, 0, 0) to (1, 0.5, 1), in ``counts`` cells on each side of the rim; the left of its bottom is clamped."""
    blocks = []
    for sign in (-1.0, 1.0):
        faces = {"y0": "y0", "y1": "y1"} | ({"x0": "x0", "z0": "clamped"} if sign < 0 else {"x1": "pulled"})
        blocks.append(shapes.Brick(partial(_side, sign, 0.5, grading), counts, faces))
    return shapes.mapped(blocks, ELEMENTS[ELEMENT][0], 1)


def body(level: int, grading: float, *, plane: bool) -> Body:
    """A slice in ``plane`` strain, 4 cells a side, or a block with free ends, 3 cells a side; each ``level`` halves cell sizes."""
    n = (4 if plane else 3) * 2**level
    acting = (*neo_hooke(MU, BULK), make("traction", on="pulled", force=f"{LOAD}, 0, 0 MPa", ramp=ramp()))
    fixed = (*clamped("clamped"), *sliding("x0", *(("y0", "y1") if plane else ())))
    return Body(_halves((n, 1 if plane else 2**level, n), grading), acting, fixed, (0.0, 1.0))


def order(lab: Lab, grading: float, *, plane: bool) -> Finding:
    """The order of convergence of the force on the clamped half, from three levels: no true value of the force is needed."""
    bodies, settings = [body(level, grading, plane=plane) for level in range(3)], {"first_step": 1.0, "residual": 1e-13}
    values = [float(lab.solve(one, ELEMENT, **settings).last.forces["clamped"][0]) for one in bodies]
    first, second = abs(values[1] - values[0]), abs(values[2] - values[1])
    found = float(np.log2(first / second)) if first > 0 and second > 0 else np.nan
    return Finding(found, note=", ".join(f"{value:.7g} N" for value in values))


CONTROLS = {
    UNIFORM: control("meshes graded towards the rim", grading=GRADED),
    GRADED: control("uniform meshes", grading=UNIFORM),
}
PLANE = "the coarsest of the three meshes has 4 cells a side; finer meshes bring the order closer to the true one by"
ON_PLANE = "A clamped patch in plane strain: order of convergence of its force, with quadratic hexahedra,"
ON_BLOCK = "A clamped patch on a block with free ends: order of convergence of its force, with quadratic hexahedra,"
SPACE = "the coarsest of three meshes has 3 cells a side and one cell along the rim, whose ends add their own error"

ENTRIES = tuple(
    Entry(
        name=name,
        group="rims of attachments",
        title=title,
        unit="",
        measure=order,
        given={"grading": grading, "plane": name.startswith("rim_plane")},
        **CONTROLS[grading],
        truth=float(find("rims").far_order(np.pi, 0.5, grading)),
        within=within,
        because=because,
        kind="closed form",
        source="validation/rims.py: Williams 1952",
    )
    for name, grading, within, title, because in (
        ("rim_plane", UNIFORM, 0.1, f"{ON_PLANE} uniform", f"{PLANE} 0.006"),
        ("rim_plane_graded", GRADED, 0.2, f"{ON_PLANE} graded towards the rim, h ~ r^(1/2)", f"{PLANE} 0.1"),
        ("rim_block", UNIFORM, 0.2, f"{ON_BLOCK} uniform", SPACE),
        ("rim_block_graded", GRADED, 0.4, f"{ON_BLOCK} graded towards the rim, h ~ r^(1/2)", SPACE),
    )
)
