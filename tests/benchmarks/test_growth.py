"""Growth of costs with size: candidates in an iteration, the reference by phase, and the numbers of a fit."""

import math

import pytest

from benchmarks import candidates, growth

SLOW = dict.fromkeys(("rbf_muscle", "pbd_program", "arap", "mass_spring"), pytest.mark.nightly)  # by day the others
POINTS = [{"size": 10.0**k, "iteration": 2e-6 * 100.0**k, "memory": 0.0} for k in range(3)]


def test_the_numbers_of_a_fit_are_shown_by_name() -> None:
    found = growth.law(POINTS, "iteration")
    assert growth.shown(found, "exponent") == pytest.approx(2.0)
    assert growth.shown(found, "standard error") == pytest.approx(0.0, abs=1e-9)
    for name in ("at 1e7", "at 1e7, at least", "at 1e7, at most"):
        assert growth.shown(found, name) == pytest.approx(2e-6 * 1e14, rel=1e-6)
    assert math.isnan(growth.shown(growth.law(POINTS, "memory"), "exponent"))


@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param(name, marks=SLOW.get(name, ())) for name in growth.GROWING])
def test_candidates_of_the_table_are_measured(name, monkeypatch) -> None:
    """All solve at three sizes; a clock by which an iteration costs the number of its cells gives growth of first order."""

    def spent(solver, settings, setup, iterations: int) -> float:
        cells = len(setup.rest.mesh.tets if setup.rest.mesh else setup.surface.triangles)
        return 0 * solve(solver, settings, setup, iterations) + 7 + 1e-6 * cells * iterations

    solve = candidates.spent
    monkeypatch.setattr(candidates, "spent", spent)
    monkeypatch.setattr(growth, "spent", spent)
    points = growth.of_candidate(name, most=3)
    assert len(points) == 3
    assert growth.law(points, "iteration").exponent == pytest.approx(1, abs=1e-6)


@pytest.mark.slow
@pytest.mark.usefixtures("fem_lab")  # it skips where nothing can be solved
def test_the_reference_is_measured_by_phase() -> None:
    points = growth.of_reference(((1, 3), (1, 6), (1, 9)))
    assert all(set(growth.OF_REFERENCE) <= set(one) for one in points)
    assert all(one["seconds_wall"] > one["seconds_assembly"] > 0 for one in points)
    sizes = [one["size"] for one in points]
    assert sizes == sorted(set(sizes))
