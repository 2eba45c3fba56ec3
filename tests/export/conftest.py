"""The problems that tests of exports share: one for FEBio with something of everything, and a small case as it is exported."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import feb_file
import numpy as np
import pytest
import small

from fem_reference import export
from fem_reference.export import febio
from fem_reference.problems import muscle
from fem_reference.problems.body import ByCell
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase


@pytest.fixture(scope="module")
def bar() -> MuscleProblem:
    return feb_file.bar()


@pytest.fixture(scope="module")
def feb(bar: MuscleProblem, tmp_path_factory: pytest.TempPathFactory) -> Element:
    folder = tmp_path_factory.mktemp("febio")
    febio.write(bar, folder)
    return ElementTree.parse(folder / "scene.feb").getroot()


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> MuscleCase:
    read = casefile.read(small.write(tmp_path_factory.mktemp("case") / "bar"))
    assert isinstance(read, MuscleCase)
    return read


@pytest.fixture(scope="module")
def built(scene: MuscleCase) -> MuscleProblem:
    """The small scene, with a direction of fibres in each tet, no two the same."""
    bar = muscle.build(scene, muscle.setup(scene))
    along = np.random.default_rng(6).normal(size=(len(bar.mesh.tets), 3))
    return replace(bar, fibre=ByCell(along / np.linalg.norm(along, axis=1)[:, None]))


@pytest.fixture(scope="module")
def exported(scene: MuscleCase, built: MuscleProblem, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export") / "bar"
    export.export(scene, lambda: built, folder, "open")
    return folder
