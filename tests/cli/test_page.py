"""The verb ``page``: what it says where nothing can be measured."""

from dataclasses import replace
from functools import partial

import pytest

from fem_reference import cli
from fem_reference.studies import cube_fits
from fem_reference.verification import muscle_bodies


def test_a_page_of_cases_without_their_files_is_refused_with_the_reason(
    tmp_path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("FEM_REFERENCE_DATA", raising=False)
    assert cli.main(["page", "estimation", "--case", "gluteus_maximus", "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert "estimation: got no case that can be measured (gluteus_maximus: " in said
    assert "FEM_REFERENCE_DATA" in said


def test_a_page_of_all_quantities_takes_no_cases(tmp_path, capsys: pytest.CaptureFixture[str]) -> None:
    for words in (("--case", "hip_flexion"), ("--unit", "mm"), ("--solve",), ("--quick",), ("--error-bar",)):
        assert cli.main(["page", "credibility", *words, "--out", str(tmp_path)]) == 2
        assert "for credibility" in capsys.readouterr().err


@pytest.mark.slow
def test_without_the_anatomy_moment_arms_are_not_measured(
    tmp_path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("FEM_REFERENCE_DATA", raising=False)
    quick = tuple(replace(one, measure=lambda *_, **__: 1.0) for one in muscle_bodies.ENTRIES)  # bodies are verify's
    monkeypatch.setattr(muscle_bodies, "ENTRIES", quick)
    monkeypatch.setattr(cube_fits, "collagen_law", partial(cube_fits.collagen_law, 1))  # the fit has its own test
    assert cli.main(["page", "credibility", "--out", str(tmp_path), "--quiet"]) == 0
    printed = capsys.readouterr().out
    assert "1 not compared" in printed
    assert "left out: iliacus_anatomical" in printed
