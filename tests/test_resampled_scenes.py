"""A scene on other triangles reads its surface from where studies keep it, although its file may name none there."""

from pathlib import Path

import small

from fem_reference.problems import muscle
from fem_reference.scenes import casefile
from fem_reference.studies.resampled_scenes import resample


def test_it_can_be_set_up_from_a_folder_outside_the_case(tmp_path: Path) -> None:
    scene = casefile.read_muscle(small.write(tmp_path / "case" / "bar"))
    rest = muscle.setup(scene)
    coarse = muscle.setup(resample(scene, rest, -1, tmp_path / "elsewhere"))
    assert len(coarse.surface.triangles) < 0.5 * len(rest.surface.triangles)
    assert [one.attachment for one in coarse.attached] == [one.attachment for one in rest.attached]
