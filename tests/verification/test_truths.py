"""The truths are found wherever Python looks for modules, and no other package of their name is taken for them."""

import re
import sys
from types import ModuleType

import pytest

from fem_reference.verification import truths

MODULES = sorted(path for path in truths.FOLDER.glob("*.py") if path.stem != "__init__")


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_a_truth_states_what_it_knows_and_where_that_is_from(path) -> None:
    # A work with its year, or that it is derived there.
    module = truths.find(path.stem)
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
    assert truths.find("torsion").square_bar_stiffness(2.0, 1.0) == pytest.approx(2 * 0.1406, abs=1e-4)
    with pytest.raises(ModuleNotFoundError, match="nothing_of_the_kind"):
        truths.find("nothing_of_the_kind")


@pytest.mark.usefixtures("unloaded")
def test_truths_may_import_each_other(monkeypatch, tmp_path) -> None:
    folder = tmp_path / "validation"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "base.py").write_text("three = 3\n")
    (folder / "top.py").write_text("from validation.base import three\n\nsix = 2 * three\n")
    monkeypatch.setattr(truths, "FOLDER", folder.resolve())
    assert truths.find("top").six == 6
    assert truths.find("base") is truths.find("base")


@pytest.mark.usefixtures("unloaded")
def test_another_package_of_that_name_is_refused(monkeypatch, tmp_path) -> None:
    other = ModuleType("validation")
    other.__path__ = [str(tmp_path)]
    monkeypatch.setitem(sys.modules, "validation", other)
    with pytest.raises(ImportError, match='another package "validation" is loaded'):
        truths.find("torsion")
