"""What bones do at material points of a body: the slope that Newton's method is given is that of the tractions."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from slides import Slide

from fem_reference.geometry.rigid_bodies import Capsule
from fem_reference.problems.contact import ContactBone, ContactLaw
from fem_reference.solvers.fenicsx.contact import ContactForces
from fem_reference.solvers.fenicsx.contact_points import ContactPoints
from fem_reference.solvers.fenicsx.spent import Spent

# Around a capsule along z, beside it and at its ends, at gaps from below -SMOOTHING to above 0.
SMOOTHING = 0.2
PLACES = np.array([[1.1, 0, 1], [0.6, 0.7, 2], [-0.9, 0.2, 0.5], [0, -1.0, 3], [0.3, 0.4, 4.8], [-0.5, 0.1, -0.75]])


def nodes_of(count: int) -> SimpleNamespace:
    """Unknowns of so many nodes, as a function of one process has them."""
    space = SimpleNamespace(mesh=SimpleNamespace(comm=SimpleNamespace(allgather=lambda one: [one])))
    return SimpleNamespace(x=SimpleNamespace(array=np.zeros(3 * count)), function_space=space)


def moved(points: np.ndarray, pose: Slide) -> ContactForces:
    """One capsule in a ``pose``, and ``points`` (n, 3) that are unknowns each."""
    count = len(points)
    dofs = np.arange(3 * count).reshape(count, 1, 3)
    own = ContactPoints(points, np.ones(count), np.arange(count), np.ones((count, 1)), points[:, None, :], dofs)
    unknowns = nodes_of(count)
    capsule = ContactBone("capsule", Capsule((0.0, 0, 0), (0.0, 0, 4), 1.0), pose)
    return ContactForces(ContactLaw("skin", 3.0, SMOOTHING), (capsule,), own, unknowns, 0.0, Spent())


@pytest.mark.parametrize("turned", [(0.0, 0.0, 0.0), (0.7, -0.4, 1.1)])
def test_the_slope_is_that_of_the_tractions_wherever_the_bone_is(turned) -> None:
    pose = Slide((0.0, 0.0, 0.0), (5.0, -3.0, 2.0), turned)
    points = PLACES @ pose(0.0)[:3, :3].T + pose(0.0)[:3, 3]
    (now,) = moved(points, pose).now
    assert (now.pressure > 0).all()
    step = 1e-6
    for k, along in enumerate(step * np.eye(3)):
        (_, after), (_, before) = (moved(points + sign * along, pose).tractions() for sign in (1, -1))
        assert now.slope[:, :, k] == pytest.approx((after - before) / (2 * step), abs=1e-7)
