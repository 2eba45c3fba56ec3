"""The implicit muscle of few Gaussians: rest, rigid motion, volume, bones, and that nothing depends on numbering."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import enclosed_volume
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.geometry.rigid_bodies import Sphere
from fem_reference.problems.setup import Bone, Setup
from fem_reference.solvers import rbf_muscle
from tests.solvers.test_arap import SWING, attached_setup, muscle


def run(setup: Setup, **changes):
    frames = []
    settings = rbf_muscle.RbfSettings(**({"gaussians": 12} | changes))
    outcome = rbf_muscle.solve(setup, settings, frames.append)
    return outcome, {frame.number: frame.surface for frame in frames}


@pytest.mark.slow
def test_a_muscle_whose_bones_move_alike_moves_with_them() -> None:
    setup = attached_setup(SWING, SWING, last=10)
    outcome, frames = run(setup)
    assert outcome.status == "converged"
    # Local and global steps go on from the state before, which is 3 degrees away: what is left of it after ten.
    assert_allclose(frames[10], apply(SWING.pose(10), setup.surface.points), atol=0.2)
    assert_allclose(run(setup, iterations=100)[1][10], apply(SWING.pose(10), setup.surface.points), atol=1e-6)


@pytest.mark.slow
def test_the_volume_is_kept_and_lost_without_it() -> None:
    pull = RigidMotion((0, 0, 1), None, (0.0, 10.0), (0.0, 15.0))
    setup = attached_setup(None, pull, last=10)
    rest = enclosed_volume(setup.surface.points, setup.surface.triangles)
    kept, lost = (
        abs(enclosed_volume(run(setup, volume=volume)[1][10], setup.surface.triangles) / rest - 1)
        for volume in (True, False)
    )
    assert kept < 0.01 < lost


@pytest.mark.slow
def test_bones_are_avoided() -> None:
    """A ball of 8 mm comes 10 mm into the side of the muscle, whose half width is 20 mm."""
    surface, ball = muscle(), shapes.sphere(2, 8.0)
    coming = RigidMotion((-1, 0, 0), None, (0.0, 10.0), (0.0, 12.0))
    place = np.array([30.0, 0.0, 0.0])
    bone = Bone("ball", ball.moved_to(ball.points + place), coming, solid=Sphere((30.0, 0.0, 0.0), 8.0))
    still = attached_setup(None, None, surface, last=10)
    setup = Setup(surface, (*still.bones, bone), still.attached, still.frames, None)
    # The bones of the ends are the muscle's own surface, which nothing can be outside of.
    setup = Setup(surface, (bone,), still.attached, still.frames, None)
    depth = [
        8 - np.linalg.norm(run(setup, contact=contact)[1][10] - (place - [12, 0, 0]), axis=1).min()
        for contact in (True, False)
    ]
    assert depth[0] < 0.2
    assert depth[1] > 3


def test_back_where_it_began_it_is_at_rest() -> None:
    there_and_back = RigidMotion((1, 0, 0), (0, 20, -10), (0.0, 5.0, 10.0, 20.0), (0.0, 0.3, 0.0, 0.0))
    setup = attached_setup(None, there_and_back, last=20)
    _, frames = run(setup)
    assert_allclose(frames[0], setup.surface.points)
    assert np.abs(frames[20] - setup.surface.points).max() < 0.01


def test_a_muscle_without_attachments_is_refused() -> None:
    setup = Setup(muscle(), (), (), (0, 1), None)
    with pytest.raises(InputError, match="without attachments"):
        run(setup)


def test_gaussians_that_nothing_holds_are_refused() -> None:
    """Two clouds of ten nodes far from each other, of which one has the points that are given."""
    cloud = np.random.default_rng(3).normal(size=(10, 3))
    with pytest.raises(InputError, match="not connected to any attachment"):
        rbf_muscle.Cloud.of(np.concatenate([cloud, cloud + 1000]), cloud[:4] + 0.1)
