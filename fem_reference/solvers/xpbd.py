"""Extended position based dynamics (XPBD) of the muscle surface, with compliances and time in physical units.

Macklin, Mueller and Chentanez 2016, "XPBD: position-based simulation of compliant constrained dynamics", DOI
10.1145/2994258.2994272; the method is mentioned in report section 5.5.3. The surface is a membrane with mass, and its interior
resists changes of volume. In position based dynamics, which has the same constraints, each additional sweep or step increases the
stiffness. In XPBD, too few sweeps make the muscle too soft, and enough sweeps give an implicit Euler step. If the sweeps converge
in each step, the equilibrium depends on the time step only if constraint gradients change direction within it. Convergence needs
many sweeps, or ``sqrt(k / m) dt`` below about 1 for the stiffest edges. With the one sweep of Table 5.1, this is up to 3, and above
1.1 for half the edges: doubling the sub-steps changes positions in hip_flexion by up to 1.6 mm (mean 0.7 mm; displacement 53 mm).

Frame number n is the state after iteration n, ``frame_time`` after the previous frame. Bones move at constant velocity in between.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from pydantic import Field

from fem_reference.foundations import units
from fem_reference.foundations.mesh import Floats, Ints, Surface, enclosed_volume, triangle_areas, vertex_areas
from fem_reference.foundations.records import Record
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Outcome, Sink
from fem_reference.solvers.collision_kernels import CollidingBone, colliding_bones
from fem_reference.solvers.common.frame_loop import MovingSurface, carry, follow, other_clock, timed
from fem_reference.solvers.common.protocol import MuscleSolver, TableRow, Trade
from fem_reference.solvers.pbd import hinges_of
from fem_reference.solvers.pbd_kernels import dihedrals, distances, pull_dihedrals, pull_distances, pull_volume, volume


class XpbdCollision(Record):
    """Contact of bones with free vertices.

    ``gap`` [mm]: the distance between a vertex and a bone at which contact begins; for a vertex that is closer at rest, contact
    begins at its distance at rest. ``stiffness`` [MPa/mm]: under a pressure p the surface comes closer by p / stiffness.
    """

    gap: Annotated[units.Length, Field(ge=0)]
    stiffness: units.AreaStiffness


class XpbdSettings(Record):
    """Settings of the method and of the muscle. The first four keys are required; each of the other keys adds an effect.

    ``frame_time`` [s]: the time between two frame numbers in this solver, which replaces the interval of the scene. ``sub_steps``:
    the number of time steps in a ``frame_time``. ``sweeps``: the number of sweeps over all constraints in each time step.
    ``density`` [t/mm3]: the density of the enclosed body, whose mass is divided among the vertices in proportion to their areas.

    ``stretch`` [N/mm]: Young's modulus times the thickness of a membrane. ``bending`` [N mm]: the bending stiffness of a plate.
    ``volume`` [MPa]: the bulk modulus of the enclosed body. ``damping`` [1/s]: the rate at which velocities decay. ``collision``:
    contact with bones.
    """

    frame_time: units.Time
    sub_steps: Annotated[int, Field(gt=0), Trade((1, 3, 10, 30))]
    sweeps: Annotated[int, Field(gt=0), Trade((1, 3, 10, 30))]
    density: units.Density
    stretch: units.Stiffness | None = None
    bending: units.BendingStiffness | None = None
    volume: units.PositivePressure | None = None
    damping: units.Rate | None = None
    collision: XpbdCollision | None = None


@dataclass(frozen=True, eq=False)
class XpbdConstraints:
    """Compliant constraints that pull a body towards its rest state: edges, an enclosed volume, hinges. Each kind may be absent.

    ``inverse_masses`` (n,) [1/t]: 0 for attached points. ``edges`` (e, 2), which may form any graph, with their ``lengths`` at rest
    (e,) [mm] and compliances ``edge_softness`` (e,) [mm/N]. ``triangles`` (m, 3), which form a closed surface, with six times the
    volume inside at rest, ``six_volumes`` [mm3], and its compliance ``volume_softness`` [mm5/N]. ``hinges`` (h, 4) with their
    ``angles`` at rest (h,) [rad] and compliances ``hinge_softness`` (h,) [1/(N mm)].
    """

    inverse_masses: Floats
    edges: Ints
    lengths: Floats
    edge_softness: Floats
    triangles: Ints
    six_volumes: float
    volume_softness: float
    hinges: Ints
    angles: Floats
    hinge_softness: Floats

    @classmethod
    def at_rest(cls, surface: Surface, attached: Ints, settings: XpbdSettings) -> "XpbdConstraints":
        """The constraints of a closed ``surface`` with ``attached`` vertices (k,); a kind without stiffness is absent.

        An edge of length l has the stiffness ``stretch a / l^2``, where a is the total area of its two triangles; its hinge has the
        stiffness ``bending l^2 / a``. In a regular mesh of equal triangles these form a membrane whose Young's modulus times
        thickness is ``stretch``, with Poisson's ratio 1/3, and a plate of bending stiffness ``bending`` (Seung and Nelson 1988,
        DOI 10.1103/PhysRevA.38.1005).
        """
        # Compiled functions need writable arrays.
        points, triangles = np.array(surface.points), np.array(surface.triangles)
        hinges, six_volumes = hinges_of(triangles), volume(points, triangles)[0]
        areas = sum(triangle_areas(points, hinges[:, corners]) for corners in ([0, 1, 2], [0, 1, 3]))  # both triangles
        slender = distances(points, hinges) ** 2 / areas
        stiffnesses = settings.stretch, settings.bending, settings.volume
        stretched, bent, filled = (slice(None if stiffness else 0) for stiffness in stiffnesses)
        return cls(
            inverse_masses=inverse_masses(surface, attached, settings.density),
            edges=np.ascontiguousarray(hinges[stretched, :2]),
            lengths=distances(points, hinges[stretched]),
            edge_softness=slender[stretched] / (settings.stretch or math.inf),
            triangles=triangles[filled],
            six_volumes=six_volumes,
            volume_softness=6 * six_volumes / (settings.volume or math.inf),
            hinges=hinges[bent],
            angles=dihedrals(points, hinges[bent]),
            hinge_softness=1 / (slender[bent] * (settings.bending or math.inf)),
        )


@dataclass(frozen=True)
class XpbdStep:
    """The parameters of a time step.

    ``seconds``: its duration. ``sweeps``: the number of sweeps over all constraints. ``damping`` [1/s]. ``acceleration`` [mm/s2]:
    the external acceleration.
    """

    seconds: float
    sweeps: int
    damping: float
    acceleration: tuple[float, float, float] = (0.0, 0.0, 0.0)


def inverse_masses(surface: Surface, attached: Ints, density: float) -> Floats:
    """The inverse masses (n,) [1/t] of the vertices, 0 for ``attached`` vertices.

    The mass of the body is divided among all vertices in proportion to their areas.
    """
    areas = vertex_areas(surface.points, surface.triangles)
    mass = density * enclosed_volume(surface.points, surface.triangles) * areas / areas.sum()
    found = 1 / mass
    found[attached] = 0
    return np.asarray(found)


class BoneContact:
    """Contact with a ``bone``: the compliance ``softness`` (n,) [mm/N] at vertices, and the multipliers (n,) of the time step."""

    def __init__(self, bone: CollidingBone, softness: Floats) -> None:
        self.bone, self.softness = bone, softness
        self.multipliers = np.zeros(len(softness))

    def project(self, points: Floats, inverse_masses: Floats, seconds: float) -> Floats:
        """The displacements (n, 3) [mm] due to one projection. Contact never pulls: no multiplier becomes negative.

        ``seconds``: the duration of the time step.
        """
        vertices, value, away = self.bone.near(points)
        soft, before, mass = self.softness[vertices] / seconds**2, self.multipliers[vertices], inverse_masses[vertices]
        after = np.maximum(before - (value + soft * before) / (mass + soft), 0)
        self.multipliers[vertices] = after
        self.bone.watch(vertices[after > 0])
        moves = np.zeros_like(points)
        moves[vertices] = ((after - before) * mass)[:, None] * away
        return moves


def advance(
    points: Floats,
    velocities: Floats,
    constraints: XpbdConstraints,
    step: XpbdStep,
    contacts: Sequence[BoneContact] = (),
) -> tuple[Floats, Floats]:
    """Positions (n, 3) [mm] and velocities (n, 3) [mm/s] after one time step, by Algorithm 1 of the paper."""
    at, dt = constraints, step.seconds
    loose = (at.inverse_masses > 0)[:, None]
    velocities = math.exp(-step.damping * dt) * velocities + np.where(loose, dt * np.array(step.acceleration), 0.0)
    moved = points + dt * velocities
    of_edges, of_hinges, of_volume = np.zeros(len(at.edges)), np.zeros(len(at.hinges)), 0.0
    edges, hinges, enclosed = at.edge_softness / dt**2, at.hinge_softness / dt**2, at.volume_softness / dt**2
    for contact in contacts:
        contact.multipliers[:] = 0
    for _ in range(step.sweeps):
        pull_distances(moved, at.inverse_masses, at.edges, at.lengths, edges, of_edges)
        of_volume = pull_volume(moved, at.inverse_masses, at.triangles, at.six_volumes, enclosed, of_volume)
        pull_dihedrals(moved, at.inverse_masses, at.hinges, at.angles, hinges, of_hinges)
        moved += sum((contact.project(moved, at.inverse_masses, dt) for contact in contacts), np.zeros_like(moved))
    return moved, (moved - points) / dt


def solve(setup: Setup, settings: XpbdSettings, sink: Sink) -> Outcome:
    """Iterate from rest at the first of ``setup.frames`` to the last; each requested frame goes to ``sink``."""
    outcome = follow(timed(XpbdSurface, setup, settings), setup, sink, settings.sub_steps)
    return replace(outcome, message=outcome.message + other_clock(setup, settings.frame_time))


class XpbdSurface(MovingSurface):
    """A surface with its constraints, the ``velocities`` (n, 3) [mm/s] of its vertices, and its ``contacts`` with bones."""

    def __init__(self, setup: Setup, settings: XpbdSettings) -> None:
        super().__init__(setup)
        surface, attached = setup.surface, setup.attached_vertices
        self.settings, self.constraints = settings, XpbdConstraints.at_rest(surface, attached, settings)
        self.step = XpbdStep(settings.frame_time / settings.sub_steps, settings.sweeps, settings.damping or 0.0)
        self.velocities, self.contacts = np.zeros_like(self.points), list[BoneContact]()
        if (collision := settings.collision) is not None:
            softness = 1 / (collision.stiffness * vertex_areas(surface.points, surface.triangles))
            bones = colliding_bones(setup.bones, surface.points, attached, collision.gap)
            self.contacts = [BoneContact(bone, softness) for bone in bones]
        self.cost["projections"] = 0.0

    def move(self, number: int) -> None:
        """Run one iteration, which consists of ``sub_steps`` time steps, up to frame ``number``."""
        now, chosen = (self.points, self.velocities), self.settings
        for step in range(1, chosen.sub_steps + 1):
            frame = number - 1 + step / chosen.sub_steps
            carry(now[0], self.setup, frame)
            for contact in self.contacts:
                contact.bone.move(frame)
            now = advance(*now, self.constraints, self.step, self.contacts)
        self.points, self.velocities = now
        sweep = len(self.constraints.edges) + len(self.constraints.hinges) + (chosen.volume is not None)
        self.cost["projections"] += sweep * chosen.sweeps * chosen.sub_steps


_EXAMPLE = {"frame_time": "20 ms", "sub_steps": 2, "sweeps": 2, "density": "1060 kg/m3", "stretch": "0.4 N/mm"}
# The constraints of the solver pbd, with compliances instead of stiffnesses.
_TABLE = TableRow(
    "PBD",
    "xpbd",
    {"frame_time": "10 ms", "sub_steps": 20, "sweeps": 1, "density": "1060 kg/m3", "damping": "5 1/s"}
    | {"stretch": "0.4 N/mm", "bending": "0.3 N mm", "volume": "10 MPa"}
    | {"collision": {"gap": "0 mm", "stiffness": "500 kPa/mm"}},
)
SOLVES = (
    MuscleSolver(settings=XpbdSettings, solve=solve, example=_EXAMPLE, depends_on=("order", "size"), table=(_TABLE,)),
)
