"""Cook's membrane in the catalogue: cheap entries pass, with their spoils they fail, and the mesh is what it should be."""

import importlib.util
from collections.abc import Iterator

import numpy as np
import pytest

from fem_reference.catalogue import Entry, Lab, result
from fem_reference.verification import cook

BY_NAME = {entry.name: entry for entry in cook.ENTRIES}
CHEAP = (
    "cook_compressible",
    "cook_constant_pressure",
    "cook_nearly_incompressible",
    "cook_p1_locks",
    "cook_taylor_hood",
)


@pytest.fixture(scope="module")
def lab() -> Iterator[Lab]:
    if not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")):
        pytest.skip("FEniCSx is not installed")
    from fem_reference.verification.lab import lab

    with lab() as opened:
        yield opened


@pytest.mark.parametrize("name", CHEAP)
def test_cheap_entries_pass(name: str, lab: Lab) -> None:
    entry = BY_NAME[name]
    found = result(entry, entry.measure(lab), 0.0, spoiled=False)
    assert found.word == "pass", (found.finding, found.truth)


@pytest.mark.parametrize("entry", cook.ENTRIES, ids=lambda entry: entry.name)
def test_spoils_fail(entry: Entry, lab: Lab) -> None:
    found = result(entry, entry.spoiled(lab), 0.0, spoiled=True)
    assert found.word == "fail", (found.finding, found.truth)
    assert found.error > 1.5 * found.within


def test_cells_crowd_towards_the_clamped_corners() -> None:
    """The area of a quadrilateral of corners a, b, c, d is half the cross product of its diagonals: 1440 mm2, 2 mm thick."""
    mesh = cook.Panel("FINITE", "Q2/Q1").body(4).mesh
    corners = mesh.points[mesh.cells]
    edges = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    assert edges.max() > 2 * edges.min()
    flat = corners[:, [0, 1, 3, 2], :2]
    across, along = flat[:, 2] - flat[:, 0], flat[:, 3] - flat[:, 1]
    areas = (across[:, 0] * along[:, 1] - across[:, 1] * along[:, 0]) / 2
    assert abs(areas).sum() == pytest.approx(1440, rel=1e-12)
    assert np.ptp(mesh.points[:, 2]) == cook.THICKNESS
