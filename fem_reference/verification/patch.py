"""Patch tests: linear displacements and finite rotations, which every element must represent exactly on cells of any shape."""

from dataclasses import replace

import numpy as np

from fem_reference.assessment.catalogue import Entry, Lab
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import Along, Matrix, Turn
from fem_reference.runs.store import Frame
from fem_reference.verification.fibres import active
from fem_reference.verification.homogeneous import BULK, NEO, SIZE, STEPS, Material, X, everywhere
from fem_reference.verification.parts import SURFACE, control, farthest, resistance

# The displacement gradient of a combined stretch, shear and rotation, which changes the volume to 1.2 times the rest volume.
GRADIENT: Matrix = ((0.2, 0.35, -0.1), (-0.15, 0.05, 0.3), (0.1, -0.2, -0.15))
COUNTS, BUMP = (2, 2, 3), 0.1
AXIS, ANGLE, CENTRE = (1.0, 2.0, 3.0), 1.0, (1.0, -2.0, 0.5)  # rad, mm
ENDS = ("z0", "z1")
AT_ONCE = {"first_step": 1.0, "smallest_step": 0.9, "residual": 1e-13}  # a failed step is not divided into smaller ones


def patch(element: str, degree: int, share: float = 1.0) -> Body:
    """A warped box whose surface moves by ``share`` times ``GRADIENT``, for an ``element`` on cells of a ``degree``."""
    mesh = shapes.warped_box(COUNTS, SIZE, ELEMENTS[element][0], degree, BUMP)
    a, b, c = ((share * x, share * y, share * z) for x, y, z in GRADIENT)
    return Body(mesh, (*NEO.effects, resistance(element, BULK)), everywhere((a, b, c)), (0, 1))


def patch_error(lab: Lab, element: str, degree: int, share: float = 1.0) -> float:
    """The largest distance [mm] of a node from its exact position under ``GRADIENT``."""
    body = patch(element, degree, share)
    points = lab.solve(body, element, first_step=0.5, residual=1e-13).last.points
    return farthest(points, body.mesh.points @ (np.eye(3) + np.array(GRADIENT)).T)


def turn(share: float) -> Turn:
    """The rotation from frame 1 to frame 2, by ``share`` times 1 rad about an oblique axis."""
    return Turn(AXIS, share * ANGLE, CENTRE, knots=((1.0, 0.0), (2.0, 1.0)))


def states(lab: Lab, material: Material, element: str, faces: tuple[str, ...], further: float) -> tuple[Frame, Frame]:
    """The states of a warped box before and after a rotation of its ``faces``.

    If all faces rotate, they do so in one step, by ``further`` times the angle. If only the two ends rotate, they do so in several
    steps, and only z1 rotates by ``further`` times the angle. Before the rotation, at frame 1, the box is at rest or contracted by
    its fibres.
    """
    mesh = shapes.warped_box(COUNTS, SIZE, ELEMENTS[element][0], 1, BUMP)
    moved = SURFACE if faces == SURFACE else ("z1",)
    turned = tuple(Prescribed(face, face, (0, 1, 2), turn(further if face in moved else 1.0)) for face in faces)
    body = Body(mesh, (*material.effects, resistance(element, BULK)), turned, (0, 1, 2), Along(X))
    solved = lab.solve(body, element, **(AT_ONCE if faces == SURFACE else STEPS))
    return solved.states[1], solved.last


def turned_error(lab: Lab, material: Material, element: str, faces: tuple[str, ...], further: float = 1.0) -> float:
    """The largest distance [mm] of a node from its exact position after the rotation."""
    before, after = states(lab, material, element, faces, further)
    return farthest(after.points, before.points + turn(1.0)(before.points, 2))


def turned_energy(lab: Lab, material: Material, element: str, faces: tuple[str, ...], further: float = 1.0) -> float:
    """The energy [N mm] that the rotation stores."""
    before, after = states(lab, material, element, faces, further)
    return after.scalars["energy"] - before.scalars["energy"]


# The softest mode of a block of volume V with n free nodes between rigid ends at a distance h has a stiffness of
# mu (pi / h)^2 V / n = 0.003 N/mm.
LEFT = "rounding and Newton's residual of 1e-13 N remain, 3e-11 mm in the softest mode of the block (about 0.003 N/mm)"
BLOCK = Entry(
    name="turned_block",
    group="rigid motion",
    title="Block whose surface is turned by 1 rad about an oblique axis in one step: largest error of a nodal position",
    unit="mm",
    measure=turned_error,
    given={"material": NEO, "element": "Q2/Q1", "faces": SURFACE},
    **control("The surface is turned 1 % further.", further=1.01),
    truth=0.0,
    within=1e-10,
    because=f"A rotation is a linear function of the rest positions: {LEFT}.",
    kind="property",
    source="Objectivity: a law depends on C = F^T F only.",
)
ELEMENT_AND_DEGREE = (*((element, 1) for element in ELEMENTS), ("Q2/Q1", 2))

ENTRIES = (
    *(
        replace(
            BLOCK,
            name=f"patch_{element.lower().replace('/', '_')}{'_curved' if degree == 2 else ''}",
            group="patch tests",
            title=f"{element} on {'curved' if degree == 2 else 'distorted'} cells represents a stretch, a shear and a turn at "
            "once: largest error of a nodal position",
            measure=patch_error,
            given={"element": element, "degree": degree},
            **control("The surface is moved 1 % too far.", share=1.01),
            because=f"Linear functions are in the space of every element, on curved (isoparametric) cells too: {LEFT}.",
            source="Patch test: Irons and Razzaque 1972; Bathe 2014, Finite Element Procedures, ch. 4.2.4",
        )
        for element, degree in ELEMENT_AND_DEGREE
    ),
    BLOCK,
    replace(
        BLOCK,
        name="turned_block_energy",
        title="Block whose ends are turned by 1 rad about an oblique axis: stored energy",
        unit="N mm",
        measure=turned_energy,
        given={"material": NEO, "element": "P2/P1", "faces": ENDS},
        negative_control="One end is turned 1 % further.",
        within=1e-14,
        because="A rotation stores no energy; only the rounding of mu/2 (I1 - 3) remains: mu/2 I1 of the entire block is 0.14 N "
        "mm, its last digit is 3e-17, and I1 and the sum over the block take some hundred operations.",
    ),
    replace(
        BLOCK,
        name="turned_muscle",
        title="Contracting block whose ends are turned by 1 rad about an oblique axis: largest error of a nodal position",
        given={"material": NEO + active(0.03), "element": "P2/P1", "faces": ENDS},
        negative_control="One end is turned 1 % further.",
        because=f"Fibres turn with the body: {LEFT}.",
    ),
)
