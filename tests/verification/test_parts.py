"""Parts of entries: truths, which are found wherever Python looks for modules, materials, clamps and readings."""

import re
import sys
from types import ModuleType

import numpy as np
import pytest

from fem_reference.problems.paths import Rest
from fem_reference.verification import parts

MODULES = sorted(path for path in parts.TRUTHS.glob("*.py") if path.stem != "__init__")


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_a_truth_states_what_it_knows_and_where_that_is_from(path) -> None:
    # A work with its year, or that it is derived there.
    module = parts.find(path.stem)
    assert len((module.__doc__ or "").splitlines()[0]) > 20
    assert re.search(r"\b(18|19|20)\d\d\b|\bderived\b", path.read_text(encoding="utf-8"), re.IGNORECASE)


@pytest.fixture
def unloaded(monkeypatch):
    """As if no truth had been loaded yet."""
    for name in [name for name in sys.modules if name.split(".")[0] == "validation"]:
        monkeypatch.delitem(sys.modules, name)
    yield
    for name in [name for name in sys.modules if name.split(".")[0] == "validation"]:
        del sys.modules[name]


@pytest.mark.usefixtures("unloaded")
def test_truths_are_found_wherever_python_looks(monkeypatch) -> None:
    monkeypatch.setattr(
        sys, "path", [path for path in sys.path if path.endswith(("site-packages", "python3.12", "zip"))]
    )
    # Timoshenko and Goodier give 0.1406 with four digits.
    assert parts.find("torsion").square_bar_stiffness(2.0, 1.0) == pytest.approx(2 * 0.1406, abs=1e-4)
    with pytest.raises(ModuleNotFoundError, match="nothing_of_the_kind"):
        parts.find("nothing_of_the_kind")


@pytest.mark.usefixtures("unloaded")
def test_truths_may_import_each_other(monkeypatch, tmp_path) -> None:
    folder = tmp_path / "validation"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "base.py").write_text("three = 3\n")
    (folder / "top.py").write_text("from validation.base import three\n\nsix = 2 * three\n")
    monkeypatch.setattr(parts, "TRUTHS", folder.resolve())
    assert parts.find("top").six == 6
    assert parts.find("base") is parts.find("base")


@pytest.mark.usefixtures("unloaded")
def test_another_package_of_that_name_is_refused(monkeypatch, tmp_path) -> None:
    other = ModuleType("validation")
    other.__path__ = [str(tmp_path)]
    monkeypatch.setitem(sys.modules, "validation", other)
    with pytest.raises(ImportError, match='another package "validation" is loaded'):
        parts.find("torsion")


def test_clamps_stay_and_slides_stay_in_their_planes() -> None:
    (base,) = parts.clamped("base")
    assert (base.on, base.components, base.path) == ("base", (0, 1, 2), Rest())
    assert [one.components for one in parts.sliding("x1", "y0", "z1")] == [(0,), (1,), (2,)]
    assert [one.on for one in parts.SYMMETRY] == ["x0", "y0", "z0"]


@pytest.mark.parametrize(("element", "name"), [("P2", "IncompressiblePenalty"), ("Q1/P0", "Incompressible")])
def test_a_material_resists_volume_change_as_its_element_does(element, name) -> None:
    law, resists = parts.neo_hooke(0.01, 5.0, element)
    assert (type(law).__name__, type(resists).__name__) == ("NeoHooke", name)
    assert resists.parameters[0][1] == 5.0


def test_frames_are_even_and_begin_at_rest() -> None:
    assert parts.frames(2, 4) == (0.0, 0.5, 1.0, 1.5, 2.0)


def test_distances_are_those_of_points() -> None:
    points = np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0]])
    assert parts.farthest(points, np.zeros((2, 3))) == 5.0
    assert parts.nearest(points, (2.0, 2.0, 0.0)) == 1
