"""Stresses of effects in a state, beside closed forms of a bar that is stretched."""

import numpy as np
import pytest
import shapes

from fem_reference.effects import make
from fem_reference.problems.stresses import StressSamples, kirchhoff


def test_stresses_of_a_stretched_bar_are_those_of_the_closed_form() -> None:
    """At constant volume ``mu (B - I tr B / 3)``, and fibres along it that pull with ``l dW/dl``, deviatoric as well."""
    mesh, stretch, mu, pull = shapes.box((1, 1, 2), (1.0, 1.0, 2.0)), 1.2, 0.01, 0.03
    F = np.diag([stretch**-0.5, stretch**-0.5, stretch])
    fibre = np.tile([0.0, 0.0, 1.0], (len(mesh.tets), 1))
    acting = [(make("neo_hooke", mu=mu), 1.0), (make("incompressible", bulk=10.0), 1.0)]
    active = make("active_tension", tension=pull, ramp=[{"frame": 0, "amount": 1.0}])
    found = StressSamples(mesh, fibre).sizes(mesh.points @ F.T, acting, [(active, 0.5)])
    share = np.sqrt(2 / 3)  # of the deviator of a uniaxial stress
    assert found.acts == pytest.approx(mu * (stretch**2 - 1 / stretch) * share, rel=1e-9)
    assert found.added == pytest.approx([0.5 * pull * stretch**2 * share], rel=1e-9)
    assert found.stretch == pytest.approx((stretch, stretch))
    both = kirchhoff([*acting, (active, 0.5)], np.tile(F, (2000, 1, 1)), np.tile(fibre[0], (2000, 1)))
    assert both[1999] == pytest.approx(both[0], rel=1e-12)  # of parts that are evaluated one after the other


def test_a_prestretch_counts_by_what_it_changes_of_the_rest() -> None:
    """At rest the energies see a bar stretched by 1.1: its stress. What is stretched by that already has a stress of its own, which
    is no part of what the prestretch adds.
    """
    mesh, stretch, mu = shapes.box((1, 1, 1), (1.0, 1.0, 1.0)), 1.1, 0.01
    fibre = np.tile([1.0, 0.0, 0.0], (len(mesh.tets), 1))
    effect = make("prestretch", stretch=stretch, ramp=[{"frame": 0, "amount": 1.0}])
    found = StressSamples(mesh, fibre).sizes(mesh.points, [(make("neo_hooke", mu=mu), 1.0)], [(effect, 1.0)])
    assert StressSamples(mesh, fibre).sizes(mesh.points, [(effect, 1.0)], []).stretch == pytest.approx(
        (stretch, stretch)
    )
    assert found.acts == pytest.approx(0.0, abs=1e-12)
    longer = mesh.points * [stretch, stretch**-0.5, stretch**-0.5]
    own = StressSamples(mesh, fibre).sizes(longer, [(make("neo_hooke", mu=mu), 1.0)], [(effect, 1.0)])
    (uniaxial, doubly) = (mu * (one**2 - 1 / one) * np.sqrt(2 / 3) for one in (stretch, stretch**2))
    assert own.acts == pytest.approx(uniaxial)
    assert own.added == pytest.approx([doubly - uniaxial])
    assert found.added == pytest.approx([mu * (stretch**2 - 1 / stretch) * np.sqrt(2 / 3)], rel=1e-9)
