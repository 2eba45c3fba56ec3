"""Points far from bones are not looked at, and nothing is felt otherwise for it."""

import numpy as np
import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from slides import Slide

from fem_reference.geometry.rigid_bodies import Obstacle, Sphere
from fem_reference.geometry.signed_distance import build
from fem_reference.geometry.tessellation import tessellated
from fem_reference.problems.contact import ContactBone, ContactLaw
from fem_reference.solvers.fenicsx.contact import ContactForces
from fem_reference.solvers.fenicsx.contact_points import ContactPoints
from fem_reference.solvers.fenicsx.spent import Spent
from tests.solvers.fenicsx.test_contact_points import SMOOTHING, nodes_of


def sheet() -> ContactPoints:
    """A sheet, 12 x 12 cells of four nodes each, that are 2 mm wide, with 49 points in a cell: bilinear between its nodes."""
    count, across = 12, (np.arange(7) + 0.5) / 7
    x, y = (side.ravel() for side in np.meshgrid(across, across))
    shares = np.stack([(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y], axis=1)
    i, j = (side.ravel() for side in np.meshgrid(np.arange(count), np.arange(count)))
    nodes = np.stack([i + (count + 1) * j + k for k in (0, 1, count + 1, count + 2)], axis=1)
    lattice = 2.0 * np.stack([nodes % (count + 1), nodes // (count + 1), 0 * nodes], axis=2)
    cells = np.repeat(np.arange(len(nodes)), len(x))
    basis, nodes, lattice = np.tile(shares, (count**2, 1)), nodes[cells], lattice[cells]
    rest = np.einsum("nk,nki->ni", basis, lattice)
    dofs = 3 * nodes[:, :, None] + np.arange(3)
    return ContactPoints(rest, np.ones(len(rest)), cells, basis, lattice, dofs)


def balls() -> dict[str, Obstacle]:
    """A ball of closed form, and one of triangles."""
    form = Sphere((12.0, 12.0, 0.0), 4.0)
    return {"exact": form, "grid": build(tessellated(form, np.zeros((1, 3)), "ball"), 0.5, 4.0)}


def passage(ball: Obstacle, every: bool) -> list[tuple[list[float], str | None, int]]:
    """A ball comes down on a sheet that trembles, lies on it, leaves through it by a leap and comes back: of each state what is out
    of balance, whether a point went through, and how many points were looked at. With ``every``, all of them are.
    """
    heights = [*np.linspace(60, 3.6, 20), *[3.6] * 5, -40, *np.linspace(-40, -3.7, 12), *np.linspace(-4, -60, 8)]
    own, unknowns = sheet(), nodes_of(13**2)
    bone = ContactBone("ball", ball, lambda frame: Slide((0, 0, 0), (0, 0, heights[int(frame)]), (0, 0.1, 0))(0))
    forces, random, found = (
        ContactForces(ContactLaw("skin", 3.0, SMOOTHING), (bone,), own, unknowns, 0.0, Spent()),
        rng(),
        [],
    )
    (nearby,), looked = forces.nearby, []
    clearance = nearby.clearance
    nearby.clearance = lambda points: (looked.append(len(points)), clearance(points))[1]
    for frame in range(len(heights)):
        unknowns.x.array[:] = random.normal(size=3 * 13**2) * 0.02
        if every:
            nearby.free[:], nearby.met[:] = -np.inf, True
        looked.clear()
        forces.update(frame)
        count, residual = sum(looked), np.zeros(3 * 13**2)
        forces.add_residual(residual, None)
        found.append((residual.tolist(), forces.trouble(np.zeros(0)), count))
        forces.settle()
    return found


def rng() -> np.random.Generator:
    return np.random.default_rng(7)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["exact", "grid"])
def test_what_comes_and_goes_is_felt_as_if_every_point_were_asked(kind) -> None:
    ball = balls()[kind]
    quick, whole = passage(ball, False), passage(ball, True)
    assert np.allclose([one[0] for one in quick], [one[0] for one in whole], rtol=1e-12, atol=1e-14)
    felt = np.array([np.any(one[0]) for one in quick])
    assert 5 < felt.sum() < len(quick) - 20
    assert [one[1] for one in quick] == [one[1] for one in whole]
    assert sum(one[1] is not None for one in quick) >= 1
    points = len(sheet().areas)
    assert all(one[2] == points for one in whole)
    assert np.array([one[2] for one in quick])[~felt].mean() < 0.3 * points
    assert all(0 < one[2] < 0.2 * points for one in quick[20:24])  # those that it lies on


@pytest.mark.slow
def test_what_stays_out_of_reach_is_not_looked_at(monkeypatch) -> None:
    """After the first look; and nothing is summed."""
    far = Slide((0, 0, 0), (0, 0, 30))
    forces = ContactForces(
        ContactLaw("skin", 3.0, SMOOTHING),
        (ContactBone("ball", balls()["grid"], far),),
        sheet(),
        nodes_of(13**2),
        0.0,
        Spent(),
    )
    nearby = forces.nearby[0]
    nearby.clearance = lambda points: pytest.fail("looked at") if len(points) else np.zeros(0)
    monkeypatch.setattr(ContactPoints, "add_forces", lambda *_: pytest.fail("summed"))
    for _ in range(10):
        forces.unknowns.x.array[:] += 0.5
        forces.update(0.0)
        forces.add_residual(np.zeros(3 * 13**2), None)
        assert list(forces.tangent()) == []
        assert forces.trouble(np.zeros(0)) is None
        forces.settle()
