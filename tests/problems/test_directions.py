"""Fibre directions of bodies are unit vectors, and what a law turns them about is not along them."""

import math
from dataclasses import replace

import numpy as np
import pytest

import fem_reference as fr
from fem_reference import effects
from fem_reference.problems.checks import check
from fem_reference.problems.paths import Rest


def law(normal, **other):
    return effects.make("holzapfel_ogden", k1="5 kPa", k2=1.0, angle="30 deg", normal=normal, **other)


def body(normal, fibre, **other) -> fr.Body:
    mesh = fr.box((2, 2, 2), (1.0, 1.0, 1.0), "tetrahedron")
    fixed = fr.Prescribed("bottom", "z0", (0, 1, 2), Rest())
    acting = (effects.make("neo_hooke", mu=0.01), law(normal, **other))
    return fr.Body(mesh, acting, (fixed,), (0.0, 1.0), fibre)


def straight(*direction):
    return lambda cells, _: np.tile(np.array(direction) / np.linalg.norm(direction), (len(cells), 1))


@pytest.mark.parametrize("normal", [[0, 0, 2], [0, 0, -1e-3], [0.0, math.sin(0.01), math.cos(0.01)]])
def test_a_normal_along_the_fibres_is_refused(normal) -> None:
    """Up to the degree by which directions in a mesh are not exact: 0.01 rad are 0.57 deg."""
    want = r"effect HolzapfelOgden\.normal: got a direction .* deg from the fibre at .*, want at least 1 deg, preferably 30 deg"
    with pytest.raises(fr.InputError, match=want):
        check(body(normal, straight(0, 0, 1)), "P1")


def test_a_normal_across_the_fibres_is_taken() -> None:
    for normal in ([0.0, math.sin(0.02), math.cos(0.02)], [0, 0, 1e-6]):
        check(body(normal, straight(math.sin(0.04), 0, math.cos(0.04))), "P1")


def test_one_fibre_along_the_normal_is_enough() -> None:
    """In a body whose fibres turn from x to z with the height; all but those at its top are far from the normal."""

    def turning(_, points):
        angle = np.pi / 2 * points[:, 2]
        return np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)

    check(body([0, 1, 0], turning), "P1")
    fine = replace(body([0, 0, 1], turning), mesh=fr.box((1, 1, 20), (1.0, 1.0, 1.0), "tetrahedron"))
    with pytest.raises(fr.InputError, match=r"effect HolzapfelOgden\.normal: got a direction 0\.\d+ deg .* 1.0\) mm"):
        check(fine, "P1")
