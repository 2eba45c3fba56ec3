"""A scene on other triangles reads its surface from where studies keep it, although its file may name none there."""

from pathlib import Path

import numpy as np
import shapes
import small

from fem_reference.problems import muscle
from fem_reference.scenes import casefile
from fem_reference.studies.execution import Bench
from fem_reference.studies.resampled_scenes import nearest_vertices, resample


def test_it_can_be_set_up_from_a_folder_outside_the_case(tmp_path: Path) -> None:
    scene = casefile.read_muscle(small.write(tmp_path / "case" / "bar"))
    rest = muscle.setup(scene)
    coarse = muscle.setup(resample(scene, rest, -1, tmp_path / "elsewhere"))
    assert len(coarse.surface.triangles) < 0.5 * len(rest.surface.triangles)
    assert [one.attachment for one in coarse.attached] == [one.attachment for one in rest.attached]


def test_a_vertex_is_attached_where_the_nearest_is() -> None:
    """Points beside the vertices of a ball, each nearer to one of them than to any other."""
    ball = shapes.sphere(1, 10.0)
    beside = ball.points * 1.02 + np.random.default_rng(5).uniform(-0.3, 0.3, ball.points.shape)
    assert np.array_equal(nearest_vertices(ball, beside), np.arange(len(ball.points)))


def test_a_resampled_scene_has_one_key_wherever_its_study_is(tmp_path: Path) -> None:
    scene = casefile.read_muscle(small.write(tmp_path / "bar"))
    keys, runs = set(), set()
    for name in ("here", "elsewhere"):
        bench = Bench(scene, tmp_path / name)
        other = resample(scene, bench.setup(), -1, tmp_path / name / "surfaces")
        keys.add(other.key)
        runs.add(Bench(other, tmp_path / name).folder(other.candidate[0], "candidate[0]").name)
    assert len(keys) == len(runs) == 1
    assert keys != {scene.key}
