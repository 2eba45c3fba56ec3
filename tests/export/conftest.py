"""The problems that tests of exports share: one for FEBio with something of everything, and a small case as it is exported."""

from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import feb_file
import pytest
from exporting import built, exported, scene  # noqa: F401 - fixtures

from fem_reference.export import febio
from fem_reference.problems.muscle import MuscleProblem


@pytest.fixture(scope="module")
def bar() -> MuscleProblem:
    return feb_file.bar()


@pytest.fixture(scope="module")
def feb(bar: MuscleProblem, tmp_path_factory: pytest.TempPathFactory) -> Element:
    folder = tmp_path_factory.mktemp("febio")
    febio.write(bar, folder)
    return ElementTree.parse(folder / "scene.feb").getroot()
