"""Current measures of a candidate: of a surface, and of lines alone."""

import json
from dataclasses import replace

import numpy as np
import pytest
from balls import REFERENCE, REST, SCENE, SETUP, SHIFTS, asked, bars, checked, current, run

from fem_reference.assessment import baseline
from fem_reference.assessment.measured import CurrentMeasures
from fem_reference.foundations.errors import InputError


@pytest.fixture
def path(tmp_path):
    """A baseline, made where the reference has an error bar of 0.5 of everything."""
    file = tmp_path / "new" / "ball.json"
    baseline.update(file, current(known=bars()))
    return file


def test_a_run_of_lines_alone_is_checked_by_its_fibres(tmp_path) -> None:
    lines = replace(run("mine", SHIFTS), has_surface=False, positions=np.full((3, *REST.points.shape), np.nan))
    path, now = tmp_path / "ball.json", CurrentMeasures.of(SCENE, SETUP, lines, REFERENCE, bars())
    baseline.update(path, now)
    assert {name.split(".")[0] for name in json.loads(path.read_text())["measures"]} == {"fibre_length"}
    assert checked(path, now).word == "pass"
    assert lines.fibre_positions is not None
    aside = replace(now, candidate=replace(lines, fibre_positions=lines.fibre_positions + [0, 2, 0]))
    assert asked(checked(path, aside), "unchanged", "positions.moved").word == "fail"


def test_a_reference_without_an_interior_is_refused() -> None:
    with pytest.raises(InputError, match="reference: fibres: got a run without an interior"):
        CurrentMeasures.of(SCENE, SETUP, run("mine", SHIFTS), replace(REFERENCE, fibres=None), None)
