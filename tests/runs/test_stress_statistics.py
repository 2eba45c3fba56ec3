"""Mean and quantiles of stresses against closed forms: a stretched block, a stress that varies in cells of different sizes."""

from dataclasses import replace

import numpy as np
import pytest
import shapes

from fem_reference.foundations.mesh import Floats, TetMesh
from fem_reference.runs import stress_statistics
from fem_reference.runs.results import Results
from fem_reference.runs.states import NodalState
from fem_reference.runs.stress_statistics import STATISTICS, stress_scalars, volume_ratio
from tests.runs.test_results import FIBRE, FIBRES, MATRIX, MESH, MU, affine, make, moved, nodes


@pytest.mark.parametrize("stretch", [0.7, 1.6])
def test_a_block_stretched_along_one_axis(stretch: float) -> None:
    """Incompressible neo-Hooke: sigma = mu (l^2 - 1/l) along it, a third of that is minus the pressure (Rivlin 1948)."""
    gradient = np.diag([stretch, stretch**-0.5, stretch**-0.5])
    pull = MU * (stretch**2 - 1 / stretch)
    state = moved(affine(gradient), lambda X: pull / 3 + 0 * X[..., 0])
    found = stress_scalars(Results(MESH, MATRIX, {10.0: state}, FIBRES), 10.0)
    now = gradient @ FIBRE
    expected = {"along_fibres": pull * now[0] ** 2 / (now @ now), "von_mises": abs(pull), "pressure": -pull / 3}
    wanted = {f"stress_{name}_{one}": value for name, value in expected.items() for one in STATISTICS[name]}
    assert found == pytest.approx(wanted, abs=1e-15)
    bare = stress_scalars(Results(MESH, MATRIX, {10.0: state}), 10.0)
    assert set(bare) == {name for name in wanted if "fibres" not in name}


@pytest.mark.parametrize("most", [10**6, 1500])
def test_statistics_are_over_the_volume_and_not_over_the_cells(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """With ``u = b x^2`` along x, J - 1 = 2 b x, so that a penalty K gives the pressure -2 K b x: of a volume even in x its mean is
    at X / 2, and 5 % of it below 0.95 X. Cells crowd at the low end, as x^2: without weights the mean would be at X / 3.

    Two parts in a hundred: cells at the high end are X / 30 long, their middles a quarter or half of that apart.
    """
    monkeypatch.setattr(stress_statistics, "_MOST", most)
    box, b, bulk, size = shapes.box((60, 3, 3), (1.0, 1.0, 1.0)), 0.001, 10.0, 6.0
    points = np.column_stack([size * box.points[:, 0] ** 2, box.points[:, 1:]])
    mesh = TetMesh(points, box.tets)
    displacement = np.zeros_like(nodes(mesh, 2))
    displacement[..., 0] = b * nodes(mesh, 2)[..., 0] ** 2
    state = NodalState(displacement, np.zeros((len(mesh.tets), 0)), np.zeros((0, 0, 3)))
    found = stress_scalars(Results(mesh, (make("incompressible_penalty"),), {0.0: state}), 0.0)
    greatest = 2 * bulk * b * size
    assert found["stress_pressure_mean"] == pytest.approx(-greatest / 2, abs=0.02 * greatest)
    assert found["stress_pressure_p05"] == pytest.approx(-0.95 * greatest, abs=0.02 * greatest)
    assert found["stress_pressure_p95"] == pytest.approx(-0.05 * greatest, abs=0.02 * greatest)
    assert found["stress_von_mises_p95"] == pytest.approx(0, abs=1e-12)


def test_a_body_turned_moved_scaled_and_renumbered_has_the_same_stresses() -> None:
    """Of a state that varies: turned at rest with all its fibres, then once more as it is; stresses have no length."""
    rng = np.random.default_rng(5)
    rest, later = (np.linalg.qr(rng.normal(size=(3, 3))).Q for _ in range(2))
    rest, later = rest * np.linalg.det(rest), later * np.linalg.det(later)
    where, there = nodes(MESH, 2), nodes(MESH, 1)

    def bent(X: Floats) -> Floats:
        return X + 0.02 * X[..., [1, 2, 0]] ** 2

    pressure = 0.1 * there[..., 0] * there[..., 2]
    own = NodalState(bent(where) - where, pressure, np.zeros((0, 0, 3)))
    found = stress_scalars(Results(MESH, MATRIX, {0.0: own}, FIBRES), 0.0)
    order, cells = rng.permutation(len(MESH.points)), rng.permutation(len(MESH.tets))
    mesh = TetMesh(2.5 * MESH.points[order] @ rest.T + [3, -4, 5], np.argsort(order)[MESH.tets[cells]])
    new = 2.5 * where[cells] @ rest.T + [3, -4, 5]
    displacement = 2.5 * bent(where[cells]) @ rest.T @ later.T + [9, 8, 7] - new
    other = NodalState(displacement, pressure[cells], np.zeros((0, 0, 3)))
    again = stress_scalars(Results(mesh, MATRIX, {0.0: other}, FIBRES[cells] @ rest.T), 0.0)
    assert again == pytest.approx(found, rel=1e-9)
    assert found["stress_along_fibres_p95"] > 1.1 * found["stress_along_fibres_mean"] > 0


def test_what_is_inside_out_has_no_statistics() -> None:
    state = moved(affine(np.eye(3)))
    folded = np.array(state.displacement)
    folded[0, :, 0] = -2 * nodes(MESH, 2)[0, :, 0]
    found = stress_scalars(Results(MESH, MATRIX, {0.0: replace(state, displacement=folded)}, FIBRES), 0.0)
    assert np.isnan(list(found.values())).all()


def test_the_volume_of_a_quadratic_displacement_is_exact() -> None:
    """With ``u = b x^2`` along each axis, det F is a product of three ``1 + 2 b x``, whose integrals are those of the axes."""
    b, sizes = np.array([0.03, -0.02, 0.04]), np.array([4.0, 6.0, 8.0])
    state = moved(lambda X: b * X**2)
    assert volume_ratio(MESH, state) == pytest.approx(np.prod(1 + b * sizes), rel=1e-13)
    assert volume_ratio(MESH, moved(affine(np.diag([1.1, 0.9, 1.2])), degree=1)) == pytest.approx(
        1.1 * 0.9 * 1.2, rel=1e-13
    )
