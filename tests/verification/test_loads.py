"""The column of the catalogue under its own weight, and blocks in a fluid however they are held."""

from dataclasses import replace

import numpy as np
import pytest

from fem_reference.effects import make
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Rest
from fem_reference.verification.loads import ENTRIES


@pytest.mark.slow
def test_the_column_converges_at_twice_the_degree_of_its_elements(fem_lab) -> None:
    # The displacement of the loaded end is as exact as the energy: order 4 for quadratic elements, 2 for linear ones.
    column = next(entry for entry in ENTRIES if entry.name == "heavy_column")
    assert column.find(fem_lab).order == pytest.approx(4, abs=0.05)
    assert replace(column, given=column.wrong).find(fem_lab).order == pytest.approx(2, abs=0.05)


MU, SHARE = 0.01, 0.1  # MPa, pressure over bulk modulus


def in_fluid(lab, cells: int, bulk: float, *, clamped: bool) -> float:
    """V/V0 - 0.9 of a unit cube in a fluid that wets it all round: a triangle of legs 1 / cells is clamped in its corner, or each
    of the three there may slide in its plane, which takes away the rigid motions and nothing else.
    """
    mesh = shapes.box((cells,) * 3, (1.0, 1.0, 1.0), "tetrahedron")
    corner = {
        f"at {face}": facets[[np.argmin(np.linalg.norm(mesh.points[facets].mean(axis=1), axis=1))]]
        for face, facets in mesh.facets.items()
        if face.endswith("0")
    }
    wet = np.concatenate(list(mesh.facets.values()))
    mesh = replace(mesh, facets={"wet": wet, **corner})
    sliding = tuple(Prescribed(face, face, (i,), Rest()) for i, face in enumerate(sorted(corner)))
    held = (Prescribed("clamp", "at z0", (0, 1, 2), Rest()),) if clamped else sliding
    ramp = [{"frame": 0, "amount": 0.0}, {"frame": 1, "amount": 1.0}]
    acting = (
        make("neo_hooke", mu=f"{MU} MPa"),
        make("incompressible", bulk=f"{bulk} MPa"),
        make("pressure", on="wet", pressure=f"{SHARE * bulk} MPa", ramp=ramp),
    )
    solved = lab.solve(Body(mesh, acting, held, (0.0, 1.0)), "P2/P1", first_step=1.0, residual=1e-13)
    return solved.last.scalars["volume_ratio"] - (1 - SHARE)


@pytest.mark.slow
def test_a_block_in_a_fluid_that_may_shrink_is_smaller_by_the_pressure_over_the_bulk_modulus(fem_lab) -> None:
    # p = K (J - 1) everywhere, which the element has: what is left is the residual, as in the entry pressed_volume.
    for cells, bulk in ((2, 0.1), (2, 10.0), (4, 0.1)):
        assert abs(in_fluid(fem_lab, cells, bulk, clamped=False)) < 1e-12


@pytest.mark.slow
def test_a_clamped_triangle_keeps_volume_as_its_size_cubed_and_the_shear_modulus(fem_lab) -> None:
    """Its points cannot come nearer to each other: a state of size a, so of volume a^3, whose stresses are of mu against K."""
    coarse, fine, stiff = (in_fluid(fem_lab, *given, clamped=True) for given in ((2, 0.1), (4, 0.1), (2, 10.0)))
    assert coarse == pytest.approx(0.15 * MU / 0.1 * SHARE / 8, rel=0.05)  # 0.9002, as the effect says
    # Saint-Venant: what is left of it at the far faces is smaller, and more so on the finer mesh.
    assert coarse / fine == pytest.approx(8, rel=0.05)
    assert coarse / stiff == pytest.approx(100, rel=0.05)
