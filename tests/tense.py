"""Bodies under tension at rest: a bar with fibres that bend along it, and one of straight fibres between plates."""

import sys
from dataclasses import dataclass

import cloudpickle
import numpy as np

from fem_reference import effects
from fem_reference.effects import Effect
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.foundations.records import parse
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import Affine, Along, Rest
from fem_reference.solvers.fenicsx import BodySettings


@dataclass(frozen=True)
class Curved:
    """Directions in the plane of x and z, from ``-angle`` to ``angle`` [rad] beside z over the ``length`` [mm] of a bar."""

    angle: float
    length: float

    def __call__(self, cells: Ints, points: Floats) -> Floats:  # noqa: ARG002
        """Unit vectors (n, 3)."""
        turned = self.angle * (2 * points[:, 2] / self.length - 1)
        return np.column_stack([np.sin(turned), np.zeros(len(turned)), np.cos(turned)])


ALL = (0, 1, 2)
SIZE = (10.0, 10.0, 40.0)
TONE = [{"frame": 0, "amount": 0.05}]
MU, STRESS, P1, P2 = 0.01, 0.3, 0.05, 6.6  # MPa, MPa


def effect(name: str, **parameters) -> Effect:
    return parse(effects.find(name), parameters, name)


MATRIX = effect("neo_hooke", mu="10 kPa")
MIXED, PENALTY = effect("incompressible", bulk="10 MPa"), effect("incompressible_penalty", bulk="1 MPa")
FIBRES = effect("fibre_passive", stress="300 kPa", p1=P1, p2=P2, optimal_stretch=1.0, linear_from=1.4)
ACTIVE = effect("fibre_active", stress="300 kPa", optimal_stretch=1.0, ramp=TONE)


def in_situ(stretch: float) -> Effect:
    return effect("in_situ", stretch=stretch)


def muscle(*acting: Effect, element="P2/P1", top=None, bottom=None, stiffness=None, frames=(0.0, 1.0)) -> Body:
    """A bar fixed at both ends, with fibres that are curved."""
    volume = PENALTY if ELEMENTS[element][2] is None else MIXED
    mesh = shapes.box((2, 2, 4), SIZE, ELEMENTS[element][0])
    ends = (("bottom", "z0", bottom or Rest()), ("top", "z1", top or Rest()))
    fixed = tuple(Prescribed(name, on, ALL, path, stiffness) for name, on, path in ends)
    return Body(mesh, (MATRIX, volume, FIBRES, *acting), fixed, frames, Curved(0.6, SIZE[2]))


def solved(session, body: Body, element="P2/P1", **changes):
    run = session.solve(body, BodySettings(element=element, residual=1e-9, **changes))
    assert run.outcome.status == "converged", run.outcome.message
    return run


def moved(run, body: Body) -> float:
    return float(np.abs(run.last.points - body.mesh.points).max())


def tension(stretch: float, tone: float = 0.0) -> float:
    """Force per area of the given section [MPa] along straight fibres at a ``stretch``: ``l dW/dl``."""
    passive = MU * (stretch - stretch**-2) + STRESS * P1 * (np.exp(P2 * (stretch - 1)) - 1)
    return float(stretch * (passive + tone * STRESS * (1 - 4 * (1 - stretch) ** 2)))


def plated(stretch: float, shorter: float, *acting: Effect) -> Body:
    """A bar of straight fibres between smooth plates, one of which moves."""
    mesh = shapes.box((1, 1, 2), SIZE, "tetrahedron")
    volume = effect("incompressible", bulk="1000 MPa")
    towards = Affine(((0.0,) * 3, (0.0,) * 3, (0.0, 0.0, -shorter)))
    fixed = tuple(Prescribed(f"side {i}", f"{axis}0", (i,), Rest()) for i, axis in enumerate("xyz"))
    fixed += (Prescribed("plate", "z1", (2,), towards),)
    return Body(mesh, (MATRIX, volume, FIBRES, in_situ(stretch), *acting), fixed, (0.0, 1.0), Along((0.0, 0.0, 1.0)))


cloudpickle.register_pickle_by_value(sys.modules[__name__])  # to the process that solves, which cannot import it
