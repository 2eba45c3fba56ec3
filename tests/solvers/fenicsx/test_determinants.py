"""Det F of a state: of an affine displacement it is one number everywhere, and the smallest is found with its place."""

import numpy as np
import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from fem_reference.problems import shapes
from fem_reference.problems.body import Body
from fem_reference.solvers.fenicsx import BodySettings
from fem_reference.solvers.fenicsx.body import AssembledBody
from fem_reference.verification import parts

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore:(cmap|dofmap) is deprecated")]

SLOPES = np.array([[0.1, 0.2, 0.0], [0.0, -0.3, 0.1], [0.05, 0.0, 0.2]])


@pytest.fixture(scope="module")
def body() -> AssembledBody:
    mesh = shapes.box((2, 1, 1), (2.0, 1.0, 1.0), "tetrahedron")
    return AssembledBody(Body(mesh, parts.neo_hooke(0.01, 10.0), (), (0.0, 1.0)), BodySettings(element="P2/P1"))


def move(body: AssembledBody, displacement) -> None:
    places = body.displacement.space.tabulate_dof_coordinates()
    body.unknowns.x.array[body.displacement.dofs] = displacement(places)


def test_an_affine_displacement_has_one_determinant(body) -> None:
    move(body, lambda x: x @ SLOPES.T)
    wanted = np.linalg.det(np.eye(3) + SLOPES)
    assert body.determinants.values_now() == pytest.approx(wanted, rel=1e-12)
    assert body.determinants.smallest("vertex").value == pytest.approx(wanted, rel=1e-12)
    assert body.determinants.trouble(body.unknowns.x.array) is None


def test_the_smallest_is_named_with_its_place(body) -> None:
    move(body, lambda x: np.column_stack([-0.6 * x[:, 0] ** 2 / 2, 0 * x[:, 0], 0 * x[:, 0]]))
    found = body.determinants.smallest()  # 1 - 0.6 x, least at the far end
    assert found.value == pytest.approx(-0.2, abs=1e-12)
    assert (found.where, found.at[0]) == ("vertex", pytest.approx(2.0))
    trouble = body.determinants.trouble(body.unknowns.x.array)
    assert trouble.status == "inverted"
    assert trouble.sentence.startswith("det F fell to -0.200 at a vertex of cell ")


def test_what_is_not_a_number_is_the_smallest(body) -> None:
    values = np.ones_like(body.determinants.values_now())
    values[3] = np.nan
    assert np.isnan(body.determinants.smallest_of(values).value)
