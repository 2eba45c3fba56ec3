"""The rim of a clamped area, where displacement goes with the root of the distance: at which order the error falls.

Half of the bottom of a block is clamped, so that a clamped face and a free one meet at 180 degrees. The side beyond the free half
is pulled along the bottom, by a load so small that strains are about a hundredth; the opposite side slides on a plane, so that its
corner with the clamped half is no rim.
"""

from dataclasses import dataclass, replace

import numpy as np

from fem_reference.assessment.catalogue import Entry, Finding, Lab
from fem_reference.effects import make
from fem_reference.foundations.mesh import Floats
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Cells, Prescribed
from fem_reference.problems.paths import Rest
from fem_reference.verification.parts import neo_hooke, ramp
from fem_reference.verification.truths import find

GROUP = "rims of attachments"
ELEMENT = "Q2/Q1"
MU, BULK = 0.01, 10.0  # [MPa]
LOAD = 1e-4  # [MPa]
HALF = 0.5  # of h ~ r^(1 - m)


@dataclass(frozen=True)
class _Side:
    """Points of a half of the block from those of the unit cube, crowded towards the rim x = z = 0 where ``grading`` is below 1."""

    sign: float
    depth: float
    grading: float = 1.0

    def __call__(self, unit: Floats) -> Floats:
        """Points (n, 3) [mm]."""
        x = unit[:, 0] if self.sign > 0 else 1 - unit[:, 0]
        power = 1 / self.grading
        return np.column_stack([self.sign * x**power, self.depth * unit[:, 1], unit[:, 2] ** power])


def _halves(counts: shapes.Counts, depth: float, grading: float) -> Cells:
    """The block from (-1, 0, 0) to (1, ``depth``, 1), in ``counts`` cells on either side of the rim; the left of its bottom is
    clamped.
    """
    blocks = []
    for sign in (-1.0, 1.0):
        faces = {"y0": "y0", "y1": "y1"} | ({"x0": "x0", "z0": "clamped"} if sign < 0 else {"x1": "pulled"})
        blocks.append(shapes.Block(_Side(sign, depth, grading), counts, faces))
    return shapes.mapped(blocks, ELEMENTS[ELEMENT][0], 1)


def _plane(level: int, grading: float) -> Body:
    """A slice in plane strain, of 4 cells to a side and more by factors of two."""
    n = 4 * 2**level
    mesh = _halves((n, 1, n), 0.5, grading)
    slides = tuple(Prescribed(face, face, (1,), Rest()) for face in ("y0", "y1"))
    return _pulled(mesh, slides)


def _block(level: int, grading: float) -> Body:
    """A block with free ends, of 3 cells to a side and more by factors of two."""
    n = 3 * 2**level
    return _pulled(_halves((n, 2**level, n), 0.5, grading), ())


def _pulled(mesh: Cells, slides: tuple[Prescribed, ...]) -> Body:
    acting = (*neo_hooke(MU, BULK), make("traction", on="pulled", force=f"{LOAD}, 0, 0 MPa", ramp=ramp()))
    fixed = Prescribed("clamped", "clamped", (0, 1, 2), Rest()), Prescribed("x0", "x0", (0,), Rest())
    return Body(mesh, acting, (*fixed, *slides), (0.0, 1.0))


@dataclass(frozen=True)
class Rim:
    """The order of the clamped half's force over three levels of meshes, in a ``plane`` or a block, with a ``grading``."""

    plane: bool
    grading: float

    def force(self, lab: Lab, level: int) -> float:
        """What the clamped half takes of the pull [N]."""
        body = (_plane if self.plane else _block)(level, self.grading)
        return float(lab.solve(body, ELEMENT, first_step=1.0, residual=1e-13).last.forces["clamped"][0])

    def order(self, lab: Lab) -> Finding:
        """From what three levels differ by: no truth of the force is needed."""
        values = [self.force(lab, level) for level in range(3)]
        first, second = abs(values[1] - values[0]), abs(values[2] - values[1])
        found = float(np.log2(first / second)) if first > 0 and second > 0 else np.nan
        return Finding(found, note=", ".join(f"{value:.7g} N" for value in values))

    def truth(self) -> float:
        """Twice the exponent, over the grading."""
        return float(find("rims").far_order(np.pi, 0.5, self.grading))


def _entry(name: str, title: str, rim: Rim, within: float, because: str) -> Entry:
    graded = rim.grading < 1
    other = replace(rim, grading=1.0 if graded else HALF)
    return Entry(
        name=name,
        group=GROUP,
        title=title,
        unit="",
        truth=rim.truth,
        within=within,
        relative=False,
        because=because,
        kind="closed form",
        source="validation/rims.py: Williams 1952",
        measure=rim.order,
        negative_control="uniform meshes" if graded else "graded towards the rim",
        with_negative_control=other.order,
    )


ENTRIES = (
    _entry(
        "rim_plane",
        "A patch clamped in plane strain: order of its force, uniform quadratic hexahedra",
        Rim(plane=True, grading=1.0),
        0.1,
        "the coarsest of three meshes has 4 cells to a side: over two finer ones it is 0.006 nearer",
    ),
    _entry(
        "rim_plane_graded",
        "The same on meshes graded towards the rim, h ~ r^(1/2)",
        Rim(plane=True, grading=HALF),
        0.2,
        "the coarsest of three meshes has 4 cells to a side: over two finer ones it is 0.1 nearer",
    ),
    _entry(
        "rim_block",
        "A patch clamped on a block that is free at its ends: order of its force, uniform quadratic hexahedra",
        Rim(plane=False, grading=1.0),
        0.2,
        "the coarsest of three meshes has 3 cells to a side, and one along the rim, whose ends add their own error",
    ),
    _entry(
        "rim_block_graded",
        "The same on meshes graded towards the rim",
        Rim(plane=False, grading=HALF),
        0.4,
        "the coarsest of three meshes has 3 cells to a side, and one along the rim, whose ends add their own error",
    ),
)
