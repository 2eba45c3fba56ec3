"""The rule that looks at vertices: exact where it says so, all its weights positive, and what it is for."""

import itertools
import math

import numpy as np
import pytest

pytest.importorskip("basix", reason="FEniCSx is not installed")

from fem_reference.problems.body import reference_nodes
from fem_reference.solvers.fenicsx import quadrature


@pytest.mark.parametrize("powers", [p for p in itertools.product(range(6), repeat=3) if sum(p) <= 5])
def test_exact_to_degree_five(powers) -> None:
    # The integral of x^i y^j z^k over the unit tetrahedron is i! j! k! / (i + j + k + 3)!.
    points, weights = quadrature.with_vertices()
    exact = math.prod(map(math.factorial, powers)) / math.factorial(sum(powers) + 3)
    assert weights @ np.prod(points ** np.array(powers), axis=1) == pytest.approx(exact, abs=1e-16)


def test_inside_positive_and_with_the_vertices() -> None:
    points, weights = quadrature.with_vertices()
    barycentric = np.column_stack([1 - points.sum(axis=1), points])
    assert barycentric.min() >= 0
    assert weights.min() > 0
    assert points[:4] == pytest.approx(reference_nodes("tetrahedron", 1))


@pytest.mark.parametrize(("element", "degree"), [("P1", None), ("P2/P1", 8), ("Q2/Q1", None), ("Q1/P0", 7)])
def test_other_rules_are_those_of_the_shelf(element, degree) -> None:
    _, weights = quadrature.rule(element, degree)
    assert weights.sum() == pytest.approx(1 / 6 if element.startswith("P") else 1, abs=1e-14)
    assert len(weights) == {"P1": 4, "P2/P1": 45, "Q2/Q1": 27, "Q1/P0": 64}[element]


def test_quadratic_tetrahedra_take_it() -> None:
    for element in ("P2", "P2/P1", "P2/P0"):
        assert len(quadrature.rule(element, None)[1]) == 18
