"""Contact between deformable bodies: two blocks with non-matching meshes, and a ball on a large body, both elastic (Hertz)."""

import math
from dataclasses import replace
from functools import partial

import numpy as np

from fem_reference.assessment.catalogue import Finding, Lab
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Cells, Prescribed
from fem_reference.problems.paths import Affine
from fem_reference.problems.touching import Touching
from fem_reference.runs.store import Frame
from fem_reference.verification import contact
from fem_reference.verification.contact import APPROACH, BULK, CORE, FAR, MU, POISSON, RADIUS, YOUNG
from fem_reference.verification.parts import NO_GRADIENT, clamped, control, find, neo_hooke

SOFT, TRAVEL, BLOCK_STIFFNESS = 1.0, 0.2, 0.1  # bulk modulus [MPa], path of the top [mm], contact stiffness [MPa/mm]
SMOOTHING = 0.002  # [mm]
BALL_STIFFNESS, FLAT = 2.0, 2.0  # [MPa/mm], and the distance [mm] at which the ball's curvature ends


def _mirrors(*pieces: str) -> tuple[Prescribed, ...]:
    """The planes x = 0 and y = 0 of all ``pieces`` as symmetry planes."""
    named = [(f"{piece}_{axis}0", i) for piece in pieces for i, axis in enumerate("xy")]
    return tuple(one for name, axis in named for one in clamped(name, components=(axis,)))


def _lowered(name: str, path: float, components: tuple[int, ...]) -> Prescribed:
    return Prescribed(name, name, components, Affine(NO_GRADIENT, (0.0, 0.0, -path)))


def pressed_blocks(stiffness: float, apart: float = 0.0) -> Body:
    """Two blocks with non-matching meshes, ``apart`` [mm] at rest, that form a cube together; the upper block moves down."""
    low, high = (shapes.box(counts, (1.0, 1.0, 0.5), "tetrahedron") for counts in ((3, 3, 2), (4, 5, 2)))
    mesh = shapes.joined({"low": low, "high": replace(high, points=high.points + [0, 0, 0.5 + apart])})
    moved = _lowered("high_z1", TRAVEL + apart, (2,))
    prescribed = (*_mirrors("low", "high"), *clamped("low_z0", components=(2,)), moved)
    law = Touching("low_z1", "high_z0", stiffness, SMOOTHING)
    return Body(mesh, neo_hooke(MU, SOFT), prescribed, (0.0, 1.0), touching=(law,))


def blocks(lab: Lab, stiffness: float, *, itself: bool = False) -> Finding:
    """The force [N] between the pressed blocks. Their faces are two surfaces, or one surface that touches ``itself``."""
    body = pressed_blocks(stiffness, SMOOTHING if itself else 0.0)
    if itself:  # the gap at rest then equals the smoothing, so there is no pressure at rest
        (law,), facets = body.touching, body.mesh.facets
        mesh = replace(body.mesh, facets=facets | {"faces": np.concatenate([facets[law.one], facets[law.other]])})
        body = replace(body, mesh=mesh, touching=(replace(law, one="faces", other="faces"),))
    state = lab.solve(body, "P2/P1", first_step=0.5, residual=1e-11).last
    # The force acts on an area of 1 mm2.
    most = state.scalars["touching_pressure"] / -float(state.forces["high_z1"][2])
    return Finding(float(state.forces["high_z1"][2]), note=f"the maximum pressure is {most:.3f} times the mean")


def _quarter(n: int) -> Cells:
    """A quarter of a large body, z >= 0, with ``n`` cells along each side of its core; "near" is the centre of z0."""
    mesh = shapes.ball_octant(CORE, FAR, n, 2 * n + 2, "hexahedron", 2)
    flat = mesh.facets["z0"]
    near = np.linalg.norm(mesh.points[flat][..., :2], axis=2).max(axis=1) < FLAT
    return replace(mesh, facets=mesh.facets | {"near": flat[near]})


def pressed(lab: Lab, n: int, radius: float) -> Frame:
    """The final state of a quarter of two bodies: a flat one below z = 0, and one above it with a bump of ``radius`` [mm]. Their
    far ends approach each other by APPROACH.
    """
    low, high = _quarter(n), _quarter(n + 1)
    away = np.hypot(high.points[:, 0], high.points[:, 1])
    beyond = FLAT**2 / (2 * radius) + FLAT**2 / radius * np.tanh((away - FLAT) / FLAT)  # far from the contact
    bump = np.where(away < FLAT, away**2 / (2 * radius), beyond)
    high = replace(high, points=high.points + bump[:, None] * [0, 0, 1])
    turned = {{"x0": "y0", "y0": "x0"}.get(name, name): facets for name, facets in low.facets.items()}
    low = replace(low, points=low.points[:, [1, 0, 2]] * [1, 1, -1], facets=turned)
    prescribed = (*_mirrors("low", "high"), *clamped("low_outer"), _lowered("high_outer", APPROACH, (0, 1, 2)))
    law = Touching("low_near", "high_near", BALL_STIFFNESS, 5e-4)
    mesh = shapes.joined({"low": low, "high": high})
    body = Body(mesh, neo_hooke(MU, BULK), prescribed, (0.0, 1.0), touching=(law,))
    return lab.solve(body, "Q2/Q1", first_step=0.5, residual=1e-10, newton_iterations=25).last


READINGS = contact.ball_readings("low_near on high_near")


def ball(lab: Lab, reading: str, radius: float) -> Finding:
    """A ``reading`` of the pressed bodies."""
    state = pressed(lab, 3, radius)
    return Finding(
        READINGS[reading](state), note=f"they overlap by {1000 * state.scalars['touching_depth']:.1f} micrometres"
    )


def known_ball(name: str) -> float:
    """The value of the quantity ``name`` in Hertz's closed form, for an elastic ball on a body of the same material."""
    hertz = find("hertz")
    flat, round_ = (hertz.Side(radius, YOUNG, POISSON) for radius in (math.inf, RADIUS))
    # Two equal compliances in series: half the force of a rigid ball at the same approach.
    return float(getattr(hertz.Hertz(flat, round_, hertz.force_at(RADIUS, YOUNG, POISSON, APPROACH) / 2), name))


ENTRIES = (
    *(
        contact.CONTACT(
            name=name,
            title=f"Two blocks with non-matching meshes pressed together{words}: the contact force",
            unit="N",
            measure=partial(blocks, itself=bool(words)),
            given={"stiffness": BLOCK_STIFFNESS},
            **control("contact 1 % stiffer", stiffness=1.01 * BLOCK_STIFFNESS),
            truth=partial(contact.in_series, SOFT, BLOCK_STIFFNESS, TRAVEL),
            within=2e-4,
            because="quadrature on one mesh is not exact for functions on the other: errors of 6e-5 in force, 2 % in pressure",
            source="validation/loads.py: the squeeze of a block, in series with the spring",
        )
        for name, words in (("blocks_p2_p1", ""), ("blocks_as_one", ", as one surface that touches itself"))
    ),
    *contact.hertzian(
        "hertz_elastic_{}",
        "An elastic ball pressed against a large body of the same material: {}",
        ball,
        known_ball,
        "discretisation and overlap add about 1 %; strains of 0.1 and the finite size of the bodies add less",
        READINGS,
    ),
)
