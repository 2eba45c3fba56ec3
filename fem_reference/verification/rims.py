"""Order of convergence at the rim of a clamped area, where the displacement varies as the square root of the distance from the rim.

Half of the bottom of a block is clamped, so that a clamped and a free face meet at an angle of 180 degrees. The side face next to
the free half is pulled parallel to the bottom, by a load so small that strains are about 0.01. The opposite side face slides on a
plane without friction, so that its corner with the clamped half is not singular.
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
# The exponent m of the cell sizes: cells at the distance r from the rim have the size h ~ r^(1 - m). With 1 the mesh is uniform.
UNIFORM, GRADED = 1.0, 0.5


def _side(sign: float, depth: float, grading: float, unit: Floats) -> Floats:
    """Map points ``unit`` (n, 3) of the unit cube to points (n, 3) [mm] of one half of the block, whose rim is at x = z = 0.

    ``sign``: 1 for the half with x > 0, -1 for the half with x < 0. ``depth``: size of the block along y [mm]. ``grading``: the
    exponent m of the cell sizes; if it is less than 1, the mesh is finer near the rim.
    """
    x = unit[:, 0] if sign > 0 else 1 - unit[:, 0]
    power = 1 / grading
    return np.column_stack([sign * x**power, depth * unit[:, 1], unit[:, 2] ** power])


def _halves(counts: shapes.Counts, grading: float) -> Cells:
    """The mesh of the block from (-1, 0, 0) to (1, 0.5, 1) [mm], whose bottom is clamped for x < 0.

    ``counts``: numbers of cells along x, y and z in each half of the block. ``grading``: exponent of the cell sizes.
    """
    blocks = []
    for sign in (-1.0, 1.0):
        faces = {"y0": "y0", "y1": "y1"} | ({"x0": "x0", "z0": "clamped"} if sign < 0 else {"x1": "pulled"})
        blocks.append(shapes.Brick(partial(_side, sign, 0.5, grading), counts, faces))
    return shapes.mapped(blocks, ELEMENTS[ELEMENT][0], 1)


def body(level: int, grading: float, *, plane: bool) -> Body:
    """The loaded block on a mesh of the given ``level``; each level halves the cell size of the previous level.

    ``plane``: True for a slice in plane strain, which has 4 cells along x and z in each half at level 0; False for a block with
    free faces at the ends of the rim, which has 3. ``grading``: exponent of the cell sizes.
    """
    n = (4 if plane else 3) * 2**level
    acting = (*neo_hooke(MU, BULK), make("traction", on="pulled", force=f"{LOAD}, 0, 0 MPa", ramp=ramp()))
    fixed = (*clamped("clamped"), *sliding("x0", *(("y0", "y1") if plane else ())))
    return Body(_halves((n, 1 if plane else 2**level, n), grading), acting, fixed, (0.0, 1.0))


def order(lab: Lab, grading: float, *, plane: bool) -> Finding:
    """Compute the order of convergence of the force on the clamped half.

    The order follows from the differences between three levels of meshes, so the exact force need not be known.
    """
    bodies, settings = [body(level, grading, plane=plane) for level in range(3)], {"first_step": 1.0, "residual": 1e-13}
    values = [float(lab.solve(one, ELEMENT, **settings).last.forces["clamped"][0]) for one in bodies]
    first, second = abs(values[1] - values[0]), abs(values[2] - values[1])
    found = float(np.log2(first / second)) if first > 0 and second > 0 else np.nan
    return Finding(found, note=", ".join(f"{value:.7g} N" for value in values))


CONTROLS = {
    UNIFORM: control("meshes graded towards the rim", grading=GRADED),
    GRADED: control("uniform meshes", grading=UNIFORM),
}
PLANE = "the coarsest mesh has 4 cells along x and z in each half; on finer meshes the difference from the exact order decreases by"
ON_PLANE = "Clamped patch in plane strain: order of convergence of the force on the patch, for quadratic hexahedra on"
ON_BLOCK = "Clamped patch on a block with free ends: order of convergence of the force on the patch, for quadratic hexahedra on"
SPACE = "the coarsest mesh has 3 cells along x and z in each half and one cell along the rim; the ends of the rim add an error"

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
        ("rim_plane", UNIFORM, 0.1, f"{ON_PLANE} uniform meshes", f"{PLANE} 0.006"),
        ("rim_plane_graded", GRADED, 0.2, f"{ON_PLANE} meshes graded towards the rim, h ~ r^(1/2)", f"{PLANE} 0.1"),
        ("rim_block", UNIFORM, 0.2, f"{ON_BLOCK} uniform meshes", SPACE),
        ("rim_block_graded", GRADED, 0.4, f"{ON_BLOCK} meshes graded towards the rim, h ~ r^(1/2)", SPACE),
    )
)
