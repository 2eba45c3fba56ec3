"""Muscles drawn at random: the same for the same seed, usable as cases, with what a data set is said to vary."""

import filecmp

import numpy as np

from fem_reference.effects import name_of
from fem_reference.foundations.mesh import check_closed, enclosed_volume
from fem_reference.studies import random_muscles


def test_the_same_seed_is_the_same_case_and_another_is_not(tmp_path) -> None:
    one, same, other = (
        random_muscles.write(tmp_path / name, seed, 5, 3) for name, seed in (("a", 1), ("b", 1), ("c", 2))
    )
    assert filecmp.cmp(tmp_path / "a" / "muscle.ply", tmp_path / "b" / "muscle.ply", shallow=False)
    assert one.key == same.key != other.key


def test_shapes_are_closed_and_differ() -> None:
    surfaces = [random_muscles.shape(np.random.default_rng(i))[0] for i in range(20)]
    volumes = [enclosed_volume(one.points, one.triangles) for one in surfaces]
    assert all(check_closed(one) is one for one in surfaces)
    assert min(volumes) > 0
    assert len({len(one.points) for one in surfaces}) == 1
    assert max(volumes) > 2 * min(volumes)


def test_each_three_have_what_is_stated(tmp_path) -> None:
    found = [random_muscles.write(tmp_path / str(i), 1, i, 4) for i in range(6)]
    moving = [sum(bone.motion is not None for bone in case.bone) for case in found]
    assert moving == [1, 2, 3, 1, 2, 3]
    active = ["fibre_active" in map(name_of, case.effects) for case in found]
    assert active == [True, False, True] * 2
    assert [case.fibres.kohout_kukacka is not None for case in found] == [False, True] * 3
    for case in found:
        assert case.numbers == (0, 10, 20, 30, 40)
        assert [name.name for name in case.bone][:2] == ["upper", "lower"]
