"""Metrics of scalar fields: zero against itself, a known change gives a known value, NaN never passes."""

from dataclasses import replace

import numpy as np
import pytest

from fem_reference import metrics
from fem_reference.assessment.judge import judge
from fem_reference.foundations.mesh import Surface
from fem_reference.geometry import field_mesh
from fem_reference.geometry.field_mesh import FieldMesh
from fem_reference.metrics import FieldContext, measure
from fem_reference.runs.store import Outcome, Run

ROD = FieldMesh(np.array([[0.0], [0.25], [1.0]]), np.array([[0, 1], [1, 2]]))
PLATE = FieldMesh(np.array([[0.0, 0], [2, 0], [2, 1], [0, 1]]), np.array([[0, 1, 2], [0, 2, 3]]))
SHEET = FieldMesh(np.pad(PLATE.points @ [[0.6, 0.8], [-0.8, 0.6]], ((0, 0), (0, 1))), PLATE.cells)
EXACT = FieldContext("1 + 2*x")
FIELD = {name for name in metrics.names() if metrics.metric(name).OF == "field"}


def run(mesh: FieldMesh, *frames: np.ndarray) -> Run:
    shown = {"has_surface": False, "mesh": mesh, "fields": {"psi": np.array(frames)}}
    return Run("run", "test", Outcome("converged", ""), tuple(range(len(frames))), **shown)


def exactly(mesh: FieldMesh, order: int = 1) -> np.ndarray:
    return 1 + 2 * mesh.nodes[order][:, 0]


def values(one: Run, reference: Run, context: FieldContext = EXACT) -> dict[str, list[float]]:
    return {entry.metric: entry.values.tolist() for entry in measure(one, reference, context)}


def test_what_is_declared_is_what_is_measured() -> None:
    reference = run(ROD, exactly(ROD), 2 * exactly(ROD))
    found = measure(reference, reference, EXACT)
    assert {entry.metric for entry in found} == FIELD
    for entry in found:
        assert {entry.statistic: entry.unit} == {
            name: one.unit for name, one in metrics.metric(entry.metric).STATISTICS.items()
        }
        assert entry.values.shape == (2,)
        assert len(entry.where) == 2


def test_each_is_measured_of_what_a_run_carries() -> None:
    still = np.zeros((1, 4, 3))
    surface = Surface(np.eye(4, 3), np.array([[0, 1, 2], [0, 2, 3]]))
    body = Run("body", "test", Outcome("converged", ""), (0,), surface, still)
    assert measure(body, body, EXACT, FIELD) == ()
    field = run(ROD, exactly(ROD))
    assert measure(field, field, EXACT, set(metrics.names()) - FIELD) == ()


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("mesh", [ROD, PLATE, SHEET])
def test_zero_against_itself_and_against_the_exact_solution(mesh: FieldMesh, order: int) -> None:
    one = run(mesh, exactly(mesh, order))
    found = values(one, one)
    for name in ("difference", "nodal_error", "l2_error"):
        assert found[name] == pytest.approx([0], abs=1e-14), name


@pytest.mark.parametrize("order", [1, 2])
def test_a_known_change_gives_a_known_value(order: int) -> None:
    # 1 + 2 x is 1 to 5 on the plate of area 2: one more everywhere is a fifth of 5, and sqrt(2) in L2.
    reference, other = run(PLATE, exactly(PLATE, order)), run(PLATE, exactly(PLATE, order) + 1)
    found = values(other, reference)
    assert found["difference"] == pytest.approx([0.2], rel=1e-14)
    assert found["nodal_error"] == pytest.approx([1], rel=1e-14)
    assert found["l2_error"] == pytest.approx([np.sqrt(2)], rel=1e-13)
    assert (found["minimum"], found["maximum"]) == ([2], [6])


def test_a_difference_from_nothing_is_what_it_is() -> None:
    assert values(run(ROD, np.array([0.0, -3, 1])), run(ROD, np.zeros(3)))["difference"] == [3]


def test_where_is_the_worst_vertex() -> None:
    off = exactly(PLATE) + [0, 0, -4.0, 0.5]
    found = {entry.metric: entry.where[0] for entry in measure(run(PLATE, off), run(PLATE, exactly(PLATE)), EXACT)}
    for name in ("difference", "nodal_error"):
        assert found[name] == "vertex 2 at (2, 1)"
    assert found["maximum"] == "vertex 1 at (2, 0)"


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_not_a_number_never_passes(bad: float) -> None:
    reference = run(ROD, exactly(ROD))
    for entry in measure(run(ROD, exactly(ROD) + [0, bad, 0]), reference, EXACT):
        if np.isnan(bad) or entry.metric != "minimum":
            assert judge(float(entry.values[0]), 0.0, 1e9) == "fail", entry.metric


def test_without_an_exact_solution_there_is_no_error() -> None:
    one = run(ROD, exactly(ROD))
    assert values(one, one, FieldContext(None)).keys() == {"difference", "maximum", "minimum"}


@pytest.mark.parametrize("degree", range(10))
def test_the_rules_are_exact_up_to_degree_nine(degree: int) -> None:
    # Over the unit interval x^d is 1 / (d + 1), over the unit triangle x^d is 2 / ((d + 1) (d + 2)) of its area.
    for corners, expected in ((2, 1 / (degree + 1)), (3, 2 / ((degree + 1) * (degree + 2)))):
        barycentric, weights = field_mesh.rule(corners)
        for corner in range(corners):
            assert barycentric[:, corner] ** degree @ weights == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("mesh", [ROD, PLATE])
def test_elements_of_order_two_have_quadratics(mesh: FieldMesh) -> None:
    nodes = mesh.nodes[2]
    bent = replace(run(mesh, nodes[:, 0] ** 2), name="bent")
    assert values(bent, bent, FieldContext("x**2"))["l2_error"] == pytest.approx([0], abs=1e-14)
