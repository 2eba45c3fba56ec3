"""Idealised muscles of the catalogue: their readings on states that are known, and the law that was fitted to indentations."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from fem_reference.effects import State, moduli
from fem_reference.verification import muscle_bodies
from fem_reference.verification.muscle_bodies import (
    ALONG,
    ARM,
    LENGTH,
    THICK,
    FittedOgden,
    indentation,
    vastus,
    vastus_stretch,
)

LAW = FittedOgden(mu="15.6 kPa")


class Sheared:
    """A lab whose bodies shear as a whole: by the full path at the aponeurosis, by none at the bone."""

    def solve(self, body, *_, **__):
        points = body.mesh.points.copy()
        points[:, 0] += ARM * muscle_bodies.FLEXION * points[:, 1] / THICK
        return SimpleNamespace(last=SimpleNamespace(points=points))


class Springs:
    """A lab in which a ball feels a spring of the shear modulus."""

    def solve(self, body, *_, **__):
        return SimpleNamespace(last=SimpleNamespace(forces={"ball": (0.0, 0.0, -moduli(body.effects).shear)}))


def test_the_stretch_of_a_planar_muscle_of_constant_thickness_is_the_closed_form() -> None:
    """Fibres with a fixed height, whose length along the bone grows by the path."""
    known = math.hypot(ALONG + ARM * math.pi / 3, THICK) / LENGTH
    assert known == pytest.approx(1.3859333, abs=1e-7)
    assert vastus_stretch(Sheared(), 1, ARM) == pytest.approx(known, rel=1e-12)


def test_the_aponeurosis_is_tendon_and_pulls_along_itself() -> None:
    body = vastus(1, ARM)
    middles = body.mesh.points[body.mesh.cells].mean(axis=1)
    cells = np.arange(len(middles))
    tendon = body.shares(middles, cells)["tendon"]
    assert tendon.tolist() == (middles[:, 1] > THICK).tolist()
    assert body.fibre(cells, middles)[tendon == 1] == pytest.approx(np.tile((1, 0, 0), (12, 1)))
    assert body.fibre(cells, middles)[tendon == 0] == pytest.approx(np.tile((ALONG, THICK, 0), (24, 1)) / LENGTH)


def test_the_ratio_of_forces_is_that_of_the_shipped_law_over_the_fitted() -> None:
    assert indentation(Springs(), 1, 0.6, 0.01) == pytest.approx(10 / 15.6)


def test_the_fitted_law_is_the_sum_of_powers_of_principal_stretches() -> None:
    """Ogden's energy by singular values, of which the product is taken out."""
    F = np.eye(3) + np.random.default_rng(3).uniform(-0.2, 0.2, (3, 3))
    stretches = np.linalg.svd(F, compute_uv=False) / np.linalg.det(F) ** (1 / 3)
    assert LAW.energy(State(F=F)) == pytest.approx(2 * 0.0156 / 22**2 * (np.sum(stretches**22) - 3), rel=1e-10)


def test_the_fitted_law_has_its_shear_modulus_at_rest() -> None:
    """An energy of ``mu g^2 / 2`` in a shear g of 1e-3, whose next term is 22^2 / 48 g^2 of it at most."""
    F = np.eye(3)
    F[0, 1] = 1e-3
    assert LAW.energy(State(F=F)) == pytest.approx(0.0156 * 1e-6 / 2, rel=1e-4)
    assert LAW.energy(State(F=np.eye(3))) == 0
