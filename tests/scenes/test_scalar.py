"""The case of a scalar field: domain, conditions and element are read strictly; its key follows what determines it."""

import shutil
from pathlib import Path

import fields
import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.scenes import casefile
from fem_reference.scenes.case import HOME
from fem_reference.scenes.scalar import ScalarCase

DIFFUSION = {"name": "diffusion", "coefficient": 1.0}
INTERVAL = {"interval": {"start": 0.0, "end": 1.0, "count": 5}}
ENDS = [{"on": "left", "value": 0}, {"on": "right", "value": "x + 1"}]


def scene(folder: Path, **tables: object) -> ScalarCase:
    return fields.scene(folder, **({"domain": INTERVAL, "effect": [DIFFUSION], "boundary": ENDS} | tables))


@pytest.mark.parametrize(
    ("tables", "match"),
    [
        ({"boundary": [{"on": "left"}]}, r'exactly one of "value" and "slope"'),
        ({"boundary": [{"value": 1}]}, r'exactly one of "on" and "bounds"'),
        ({"boundary": [{"bounds": "a.csv", "value": 1}]}, r'"bounds" alone'),
        ({"domain": {}}, r'exactly one of "interval", "nodes"'),
        ({"domain": {"nodes": [0.0, 0.0]}}, r"nodes in increasing order"),
        ({"domain": {"interval": {"start": 1.0, "end": 0.0, "count": 3}}}, r"an end beyond the start"),
        ({"domain": INTERVAL | {"nodes": [0.0, 1.0]}}, r'exactly one of "interval", "nodes"'),
        ({"boundary": [{"on": "left", "value": 1, "slope": 0}]}, r'exactly one of "value" and "slope"'),
    ],
)
def test_tables_that_contradict_themselves_are_named(tmp_path: Path, tables: dict[str, object], match: str) -> None:
    with pytest.raises(InputError, match=match):
        scene(tmp_path, **tables)


@pytest.mark.parametrize(("exact", "more"), [(None, set()), ("x + 1", {"exact"})])
def test_a_field_is_measured_against_what_there_is_of_it(tmp_path: Path, exact: str | None, more: set[str]) -> None:
    """A field has no rest state; a candidate has a reference beside it, and both an exact solution where it is known."""
    case = scene(tmp_path, **({} if exact is None else {"exact": exact}))
    assert case.standards("reference") == {"itself"} | more
    assert case.standards("one") == {"itself", "reference"} | more
    assert case.numbers == (0,)
    assert case.facts["domain"] == "interval"
    assert case.facts["exact solution"] == (exact or "not known")


def test_the_key_of_a_scalar_case_follows_what_determines_its_solution(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(HOME / "cases" / "plate_square", tmp_path / "plate"))
    before = casefile.read(folder).key
    assert before == casefile.read("plate_square").key
    for key, value in {"title": "x", "candidate[0].solver": "scikit_fem", "expect[0].within": 1.0}.items():
        assert casefile.read(folder, changes={key: value}).key == before
    others = {"effect[0].coefficient": 2.0, "element.order": 2, "domain.mesh.triangles": "delaunay"}
    keys = [casefile.read(folder, changes={key: value}).key for key, value in others.items()]
    for name in ("points.csv", "tri.csv", "bounds.csv"):
        text = (folder / name).read_text(encoding="utf-8")
        (folder / name).write_text(text + "\n", encoding="utf-8")
        keys.append(casefile.read(folder).key)
        (folder / name).write_text(text, encoding="utf-8")
    assert len({before, *keys}) == 1 + len(keys)
