"""Equilibrium at rest of a body in situ: the stress, the extended springs and the bones' pressure that balance its tension.

All three follow from a small displacement, the ``response`` of an isotropic body to the forces of the effects at rest. This body is
supported by its attachments and springs, and by bones that act as one-sided springs. The problem is linear once it is known which
points touch a bone; Newton's method finds these points as an active set.
"""

import numpy as np

from fem_reference.foundations.mesh import Floats
from fem_reference.solvers.fenicsx.contact import ContactForces, Pressed
from fem_reference.solvers.fenicsx.forms import Form
from fem_reference.solvers.fenicsx.multigrid import LinearSolver
from fem_reference.solvers.fenicsx.system import System

_MOST = 40  # the maximum number of linear problems
_TOLERANCE = 1e-12  # the relative tolerance of a linear problem
_SHARE = 1e-2  # the remaining residual, as a fraction of the tolerance of Newton's method


def balance(form: Form, system: System, linear: LinearSolver, residual: float) -> None:
    """Find the stress at rest of a ``form`` in situ, to a small fraction of the tolerance ``residual`` of Newton's method. Raises
    ArithmeticError if no stress at rest is found.
    """
    if form.rest is None:
        return
    response, step, contact = form.rest.response.x, system.b.duplicate(), system.contact
    supports = Supports(contact) if contact is not None else None
    for _ in range(_MOST):
        if system.residual() <= _SHARE * residual:
            if contact is not None:
                contact.look()  # the bones' reach depends on the overlaps, which have changed
            return
        forces = system.b.copy()
        with form.isotropic():
            if contact is not None and supports is not None:
                contact.now = supports.springs(response.array)
            system.linearise()
        linear.solve(forces, step, _TOLERANCE)
        moved = system.scale[: system.owned] * step.array
        response.array[: system.owned] -= np.where(system.fixed[: system.owned], 0.0, moved)
        response.scatter_forward()
        for one in system.conditions:
            one.extend(response.array)
        if supports is not None:
            supports.press(response.array)
    raise ArithmeticError(
        f"no stress at rest balances the tension after {_MOST} linear problems; try a smaller stretch"
    )


class Supports:
    """The bones of ``contact`` at rest, as one-sided springs of the law's stiffness at the points that touch them. Points that are
    within the smoothing without touching a bone do not count at rest.
    """

    def __init__(self, contact: ContactForces) -> None:
        self.contact, self.law, rest = contact, contact.law, contact.points.rest
        poses = [bone.pose(contact.frame) for bone in contact.bones]
        placed = zip(contact.bones, poses, strict=True)
        found = [bone.shape.sample((rest - pose[:3, 3]) @ pose[:3, :3]) for bone, pose in placed]
        support = self.law.in_situ or 0.0
        self.near = [np.flatnonzero(one.distance < self.law.smoothing + support) for one in found]
        self.gaps = [one.distance[near] for one, near in zip(found, self.near, strict=True)]
        self.touch = [gap <= support for gap in self.gaps]
        turned = zip(found, self.near, poses, strict=True)
        self.normals = [one.gradient[near] @ pose[:3, :3].T for one, near, pose in turned]
        self.press(np.zeros(len(contact.unknowns.x.array)))

    def press(self, response: Floats) -> None:
        """Give the bones the pressure at rest that their springs exert at a ``response`` (n,) of the unknowns."""
        for overlap, near, gap, depth in zip(
            self.contact.overlaps, self.near, self.gaps, self._depths(response), strict=True
        ):
            overlap[near] = self.law.gap(self.law.stiffness * np.maximum(depth, 0)) - gap
        self.contact.update(self.contact.frame)
        self.contact.settle()

    def springs(self, response: Floats) -> list[Pressed]:
        """The contact without pressure, with the tangent of the springs still in contact at a ``response`` (n,) of the unknowns."""
        found = []
        for near, gap, normal, depth in zip(self.near, self.gaps, self.normals, self._depths(response), strict=True):
            some = np.flatnonzero(depth >= 0)
            slope = -self.law.stiffness * normal[some, :, None] * normal[some, None, :]
            found.append(Pressed(near, gap, near[some], np.zeros(len(some)), np.zeros((len(some), 3)), slope))
        return found

    def _depths(self, response: Floats) -> list[Floats]:
        """The depth of each point in each bone at a ``response`` (n,) of the unknowns; negative outside the bone."""
        moved = self.contact.points.positions(response) - self.contact.points.rest
        placed = zip(self.near, self.normals, self.touch, strict=True)
        return [np.where(touch, -np.einsum("ni,ni->n", moved[near], normal), -np.inf) for near, normal, touch in placed]
