"""Fixtures of a small case, its problem, and its export in open formats."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small

from fem_reference import export
from fem_reference.problems import muscle
from fem_reference.problems.body import ByCell
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase


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
