"""Patch tests: linear functions and turns of any size, which every element must represent whatever the shape of its cells."""

from dataclasses import dataclass, replace

import numpy as np

from fem_reference.assessment.catalogue import Entry, Finding, Lab
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import Along, Matrix, Turn
from fem_reference.runs.solved import Reached
from fem_reference.verification.fibres import active
from fem_reference.verification.homogeneous import BULK, NEO, SIZE, STEPS, Material, X, everywhere
from fem_reference.verification.parts import resistance, zero

# Of displacement: stretch, shear and a turn at once; it takes the volume to 1.2 times that at rest.
GRADIENT: Matrix = ((0.2, 0.35, -0.1), (-0.15, 0.05, 0.3), (0.1, -0.2, -0.15))
COUNTS, BUMP = (2, 2, 3), 0.1
AXIS, ANGLE, CENTRE = (1.0, 2.0, 3.0), 1.0, (1.0, -2.0, 0.5)  # rad, mm
ENDS, SURFACE = ("z0", "z1"), ("x0", "x1", "y0", "y1", "z0", "z1")
# Between rigid ends a height h apart, n free nodes of a block of the volume V move softest with the stiffness mu (pi / h)^2 V / n:
# 0.003 N/mm.
WITHIN = 1e-10  # [mm]
LEFT = "Newton's residual of 1e-13 N is left, 3e-11 mm where the block is softest (some 0.003 N/mm), and rounding"
AT_ONCE = {"first_step": 1.0, "smallest_step": 0.9, "residual": 1e-13}  # a step that fails is not cut


@dataclass(frozen=True, eq=False)
class Patch:
    """A warped box whose whole surface follows ``share`` of ``GRADIENT``, by an ``element`` on straight (1) or curved (2) cells."""

    element: str
    degree: int = 1
    share: float = 1.0

    def body(self) -> Body:
        """The box and what moves it."""
        mesh = shapes.warped_box(COUNTS, SIZE, ELEMENTS[self.element][0], self.degree, BUMP)
        acting = (*NEO.effects, resistance(self.element, BULK))
        return Body(mesh, acting, everywhere(_times(self.share)), (0, 1))

    def error(self, lab: Lab) -> Finding:
        """How far a node is at most from where the whole gradient takes it [mm]."""
        body = self.body()
        points = lab.solve(body, self.element, first_step=0.5, residual=1e-13).last.points
        exact = body.mesh.points @ (np.eye(3) + np.array(GRADIENT)).T
        return Finding(float(np.linalg.norm(points - exact, axis=1).max()))


def _times(share: float) -> Matrix:
    """``GRADIENT`` times a number."""
    a, b, c = ((share * x, share * y, share * z) for x, y, z in GRADIENT)
    return a, b, c


@dataclass(frozen=True, eq=False)
class Turned:
    """A warped box, at frame 1 at rest or contracted, as its material is; from 1 to 2 its ``faces`` are turned by 1 rad about an
    oblique axis, z1 or the whole surface by ``further`` times as much: this in one step, two ends in as many as it takes.
    """

    material: Material
    element: str
    faces: tuple[str, ...]
    further: float = 1.0

    def states(self, lab: Lab) -> tuple[Reached, Reached]:
        """Before and after the turn."""
        mesh = shapes.warped_box(COUNTS, SIZE, ELEMENTS[self.element][0], 1, BUMP)
        moved = SURFACE if self.faces == SURFACE else ("z1",)
        prescribed = tuple(
            Prescribed(face, face, (0, 1, 2), _turn(self.further if face in moved else 1.0)) for face in self.faces
        )
        acting = (*self.material.effects, resistance(self.element, BULK))
        steps = AT_ONCE if self.faces == SURFACE else STEPS
        solved = lab.solve(Body(mesh, acting, prescribed, (0, 1, 2), Along(X)), self.element, **steps)
        return solved.states[1], solved.last

    def error(self, lab: Lab) -> Finding:
        """How far a node is at most from where the turn takes it [mm]."""
        before, after = self.states(lab)
        exact = before.points + _turn(1.0)(before.points, 2)
        return Finding(float(np.linalg.norm(after.points - exact, axis=1).max()))

    def energy(self, lab: Lab) -> Finding:
        """What the turn stores [N mm]."""
        before, after = self.states(lab)
        return Finding(after.scalars["energy"] - before.scalars["energy"])


def _turn(share: float) -> Turn:
    return Turn(AXIS, share * ANGLE, CENTRE, knots=((1.0, 0.0), (2.0, 1.0)))


def _patch(element: str, degree: int = 1) -> Entry:
    """Of an element, on straight or curved cells."""
    patch, shape = Patch(element, degree), "curved" if degree == 2 else "distorted"
    return Entry(
        name=f"patch_{element.lower().replace('/', '_')}{'_curved' if degree == 2 else ''}",
        group="patch tests",
        title=f"{element} on {shape} cells represents a stretch, a shear and a turn at once: largest error of a node",
        unit="mm",
        truth=zero,
        within=WITHIN,
        relative=False,
        because=f"Linear functions are in the space of every element, on curved (isoparametric) cells too: {LEFT}.",
        kind="property",
        source="The patch test: Irons and Razzaque 1972; Bathe 2014, Finite Element Procedures, ch. 4.2.4",
        measure=patch.error,
        negative_control="The surface is moved 1 % too far.",
        with_negative_control=replace(patch, share=1.01).error,
    )


_STRAIGHT = ("P1", "P1/P1", "P2", "P2/P1", "P2/P0", "Q1", "Q2", "Q1/P0", "Q2/Q1")
_BLOCK = Entry(
    name="turned_block",
    group="rigid motion",
    title="Block whose surface is turned by 1 rad about an oblique axis in one step: largest error of a node",
    unit="mm",
    truth=zero,
    within=WITHIN,
    relative=False,
    because=f"A turned body is a linear function of the body at rest: {LEFT}.",
    kind="property",
    source="Objectivity: a law sees C = F^T F only.",
    measure=Turned(NEO, "Q2/Q1", SURFACE).error,
    negative_control="The surface is turned 1 % further.",
    with_negative_control=Turned(NEO, "Q2/Q1", SURFACE, 1.01).error,
)
_ENERGY = replace(
    _BLOCK,
    name="turned_block_energy",
    title="Block whose ends are turned by 1 rad about an oblique axis: stored energy",
    unit="N mm",
    within=1e-14,
    because="A turn stores nothing. Of mu/2 (I1 - 3) rounding is left: mu/2 I1 of the whole block is 0.14 N mm, its last digit "
    "3e-17, and I1 and the sum over the block take some hundred operations.",
    measure=Turned(NEO, "P2/P1", ENDS).energy,
    negative_control="One end is turned 1 % further.",
    with_negative_control=Turned(NEO, "P2/P1", ENDS, 1.01).energy,
)
_MUSCLE = replace(
    _BLOCK,
    name="turned_muscle",
    title="Contracting block whose ends are turned by 1 rad: largest difference to itself turned",
    because=f"Fibres turn with the body: {LEFT}.",
    measure=Turned(NEO + active(0.03), "P2/P1", ENDS).error,
    negative_control="One end is turned 1 % further.",
    with_negative_control=Turned(NEO + active(0.03), "P2/P1", ENDS, 1.01).error,
)

ENTRIES = (*(_patch(element) for element in _STRAIGHT), _patch("Q2/Q1", 2), _BLOCK, _ENERGY, _MUSCLE)
