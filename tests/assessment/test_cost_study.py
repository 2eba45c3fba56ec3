"""Files of studies: read back whole, and refused with file and key where they are damaged."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from fem_reference.assessment.cost_study import facts, load
from fem_reference.foundations.errors import InputError
from tests.assessment.test_recommendation import RMS, TIME, study


def without(*keys: Any) -> Callable[[dict[str, Any]], None]:
    def change(table: dict[str, Any]) -> None:
        for key in keys[:-1]:
            table = table[key]
        del table[keys[-1]]

    return change


def put(value: Any, *keys: Any) -> Callable[[dict[str, Any]], None]:
    def change(table: dict[str, Any]) -> None:
        for key in keys[:-1]:
            table = table[key]
        table[keys[-1]] = value

    return change


DAMAGE = {
    "no features": (without("features"), "features.size: got nothing, want this number"),
    "a feature less": (without("features", "triangles"), "features.triangles: got nothing, want this number"),
    "a size of zero": (put(0.0, "features", "size"), "features.size: got 0, want more than 0"),
    "a feature that is text": (put("large", "features", "motion"), 'features.motion: got "large", want '),
    "a negative feature": (put(-1.0, "features", "motion"), "features.motion: got -1.0, want "),
    "foreign unit": (put("inch", "units", RMS), f'units.{RMS}: got "inch", want mm'),
    "another unit of ours": (put("%", "units", RMS), f'units.{RMS}: got "%", want mm'),
    "unit of nobody": (put("furlong", "units", "mine.own"), 'units.mine.own: got "furlong", want one of '),
    "an error below zero": (put(-1.0, "points", 1, "errors", RMS), f"points[1].errors.{RMS}: got -1.0, want "),
    "an error beyond all": (put(1e999, "points", 1, "errors", RMS), f"points[1].errors.{RMS}: got inf, want "),
    "a bar below zero": (put(-1.0, "bars", RMS), f"bars.{RMS}: got -1.0, want "),
    "a time below zero": (put(-1.0, "points", 0, "costs", TIME), f"points[0].costs.{TIME}: got -1.0, want "),
    "an error without a unit": (
        put(1.0, "points", 2, "errors", "a.b"),
        "points[2].errors.a.b: got an error without a unit",
    ),
    "a point that is none": (put(3, "points", 1), "points[1]: got 3, want "),
    "a point without its solver": (without("points", 1, "solver"), "points[1].solver: got nothing, want "),
    "a scene that is none": (put([1], "points", 0, "choice", "scene"), "points[0].choice.scene: got [1], want "),
    "half a mesh": (
        put({"muscle.tet_size": "4 mm"}, "points", 0, "choice", "scene"),
        "points[0].choice.scene.muscle.refinements: got nothing, want ",
    ),
    "a mesh of no size": (
        put({"muscle.tet_size": "fine", "muscle.refinements": 1}, "points", 0, "choice", "scene"),
        'points[0].choice.scene.muscle.tet_size: got "fine", want ',
    ),
    "another format": (put(9, "format"), "format: got 9, want 1"),
    "no case": (without("case"), "case: got nothing, want "),
}


@pytest.mark.parametrize("what", DAMAGE)
def test_a_damaged_study_is_refused_with_file_and_key(what: str, tmp_path: Path) -> None:
    damage, want = DAMAGE[what]
    path = tmp_path / "study.json"
    table = json.loads(json.dumps(facts(study("bar", 50), {"machine": "here"})))
    damage(table)
    path.write_text(json.dumps(table).replace("Infinity", "1e999"))
    with pytest.raises(InputError) as refused:
        load(path)
    assert str(refused.value).startswith(f"{path}: {want}")


def test_a_file_is_read_back_whole(tmp_path: Path) -> None:
    given = replace(study("bar", 50), bars={RMS: 1.0})
    path = tmp_path / "study.json"
    path.write_text(json.dumps(facts(given, {"machine": "here"})))
    assert list(map(vars, load(path))) == [vars(given)]
    path.write_text("[]")
    with pytest.raises(InputError, match=r"got \[\], want a study written by the verb study"):
        load(path)
