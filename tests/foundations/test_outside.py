"""Effects in a folder of one's own: found by name, part of the key of what is solved with them, refused where they are unclear."""

import sys
from pathlib import Path

import pytest
import small

import fem_reference as fr
from fem_reference import effects
from fem_reference.foundations import outside
from fem_reference.foundations.records import Record

LAW = (Path(__file__).parents[2] / "examples" / "effects" / "yeoh.py").read_text(encoding="utf-8")
EFFECT = {"name": "yeoh", "c1": "5 kPa", "c2": "1 kPa", "c3": "1 kPa"}


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """A folder with an effect of one's own."""
    place = tmp_path / "laws"
    place.mkdir()
    (place / "yeoh.py").write_text(LAW)
    monkeypatch.setenv(outside.SETTING, str(place))
    monkeypatch.setattr(effects, "__path__", [*effects.__path__, *outside.folders()])
    monkeypatch.delitem(sys.modules, "fem_reference.effects.yeoh", raising=False)
    yield place
    sys.modules.pop("fem_reference.effects.yeoh", None)


def case(tmp_path: Path) -> fr.Case:
    small.write(tmp_path / "bar")
    table = {
        "title": "A bar",
        "proves": "that a law may be of one's own",
        "muscle": {"surface": "bar.vtp", "unit": "mm", "tet_size": 6.0},
        "bone": [{"name": "floor", "surface": "floor.vtp", "unit": "mm"}],
        "attachment": [{"name": "origin", "bone": "floor", "within": 1.5}],
        "effect": [EFFECT],
        "fibres": {"traced": {"count": 4, "start": "origin", "end": "origin"}},
        "frames": {"first": 0, "last": 20, "every": 10},
        "reference": {"solver": "fenicsx"},
    }
    return fr.make_case(table, tmp_path / "bar")


@pytest.mark.usefixtures("folder")
def test_it_is_an_effect_like_any_other() -> None:
    assert "yeoh" in effects.names()
    law = fr.make_effect("yeoh", c1="5 kPa", c2=0.001, c3=0.001)
    # (I - 3) of a simple shear of 1 is 1.
    assert law.energy(effects.State([[1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])) == pytest.approx(0.007)
    with pytest.raises(fr.InputError, match=r'yeoh\.c1: got "5 mm", want a pressure'):
        fr.make_effect("yeoh", c1="5 mm", c2=0.001, c3=0.001)


def test_what_stands_in_its_file_is_part_of_the_key(tmp_path, folder) -> None:
    made = case(tmp_path)
    before = made.key
    (folder / "yeoh.py").write_text(LAW.replace("over**3", "over**4"))
    assert made.key != before


def test_a_name_that_is_taken_and_a_file_that_is_no_effect_are_refused(folder) -> None:
    (folder / "neo_hooke.py").write_text(LAW)
    with pytest.raises(fr.InputError, match=r'FEM_REFERENCE_EFFECTS: got "neo_hooke" in .* and in .*laws'):
        effects.names(Record)
    (folder / "neo_hooke.py").unlink()
    (folder / "nothing.py").write_text('"""Nothing."""\n')
    with pytest.raises(fr.InputError, match=r"nothing\.py: got 0 effects, want one class that is an effect"):
        effects.names()


def test_without_the_setting_nothing_changes(monkeypatch) -> None:
    monkeypatch.delenv(outside.SETTING, raising=False)
    assert outside.folders() == []
    assert outside.source(sys.modules["fem_reference.effects.neo_hooke"]) == b""
    assert "yeoh" not in effects.names()
