"""The external load of a bar by hand: its weight, in the middle; nothing where an effect does not say."""

from dataclasses import replace

import numpy as np
import shapes
from numpy.testing import assert_allclose

from fem_reference.effects import make
from fem_reference.problems.loads import external_load

RAMP = [{"frame": 0, "amount": 0.0}, {"frame": 10, "amount": 1.0}]
WEIGHT = make("gravity", density="1000 kg/m3", acceleration="0, -10, 0 m/s^2", ramp=RAMP)


def bar(*effects: object) -> shapes.MuscleProblem:
    return shapes.bar((1, 1, 2), (2.0, 3.0, 4.0), {"bottom": None, "top": None}, effects, (0, 10))


def test_a_weight_acts_in_the_middle() -> None:
    still = np.zeros((len(bar().mesh.tets), 10, 3))
    load = external_load(bar(WEIGHT), 5, still)
    force = np.array([0, -0.5 * 24 * 1e-9 * 1e4, 0])  # half of 24 mm3 of 1e-9 tonne/mm3 at 1e4 mm/s2, by the ramp [N]
    assert_allclose(load.force, force, rtol=1e-13)
    assert_allclose(load.moment, np.cross([1, 1.5, 2], force), rtol=1e-13)
    assert_allclose(external_load(bar(WEIGHT), 5, still + [0, 0, 1]).moment, np.cross([1, 1.5, 3], force), rtol=1e-13)


def test_without_displacements_the_moment_is_unknown() -> None:
    load = external_load(bar(WEIGHT), 10)
    assert_allclose(load.force, [0, -2.4e-4, 0], rtol=1e-13)
    assert np.isnan(load.moment).all()


def test_an_effect_that_does_not_say_leaves_it_unknown() -> None:
    assert external_load(bar(WEIGHT, make("inertia", density="1000 kg/m3")), 5) is None


def test_a_material_is_no_load() -> None:
    load = external_load(bar(make("neo_hooke", mu="10 kPa")), 5)
    assert not load.force.any()
    assert not load.moment.any()


def test_the_weight_of_a_region_is_not_that_of_the_whole() -> None:
    there = replace(bar(WEIGHT.model_copy(update={"region": "fat"})), regions={"fat": lambda points: points[:, 0] / 2})
    assert external_load(there, 5) is None
