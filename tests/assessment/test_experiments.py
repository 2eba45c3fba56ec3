"""Facts are read whole or refused with their line; only what was read and has a scatter can validate."""

import math
from pathlib import Path

import pytest

from fem_reference.assessment import experiments
from fem_reference.assessment.experiments import FOLDER, NAME, facts, find, least_specimens, ratio
from fem_reference.foundations.errors import InputError

CHEN = "vastus lateralis at rest; "


def test_every_measured_number_belongs_to_an_experiment_with_a_record() -> None:
    assert {one.experiment for one in facts()} == set(experiments.experiments())


def test_models_are_told_from_measurements() -> None:
    """Those of whose specimen the record says "a model"; the bands are numbers of several publications."""
    kinds = {name: one.kind for name, one in experiments.experiments().items()}
    assert {name for name, kind in kinds.items() if kind == "model"} == {"blemker_delp_2005", "modenese_kohout_2020"}
    assert {name for name, kind in kinds.items() if kind == "bands"} == {"scale"}
    for name, one in experiments.experiments().items():
        assert ("a model" in one.specimen) == (one.kind == "model"), name


def test_conditions_are_not_written_twice() -> None:
    keys = [(one.experiment, one.quantity, one.condition) for one in facts()]
    assert len(set(keys)) == len(keys)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (",0.5,1,", ",nan,1,"),
        (",0.5,1,", ",,1,"),
        (",0.5,1,", ",0.5,psi,"),
        (",0.5,1,,,", ",0.5,1,-1,,"),
        (",0.5,1,,,", ",0.5,1,,0,"),
        (",0.5,1,,,", ",0.5,1,,2.5,"),
        (",0.5,1,,,text,", ",0.5,1,,,guessed,"),
        (",0.5,1,,,", ",0.5,1,,,,"),
        (",0.5,1,,,", ",0.5,1,,"),
        ("poisson_ratio,load along", ",load along"),
        ("10.1016/j.jbiomech.2005.10.016,no\n", "doi.org/x,no\n"),
    ],
)
def test_an_incomplete_row_is_refused_with_its_line(old: str, new: str, tmp_path: Path) -> None:
    text = (FOLDER / NAME).read_text(encoding="utf-8")
    line = text[: text.index(old)].count("\n") + 1
    (tmp_path / NAME).write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=f"{NAME}:{line}"):
        list(facts(tmp_path))


def test_a_fact_from_memory_a_quotation_or_a_fit_never_validates() -> None:
    for one in facts():
        if one.validates:
            assert one.sd is not None
            assert one.n is not None
            assert one.n > 1
        if "memory" in (one.how, one.read_in) or one.read_in == "quotation" or one.how == "fit":
            assert not one.validates
    known = find("chen_2016", "sarcomere_length", "50 deg")
    assert known.validates
    assert not known.model_copy(update={"how": "memory"}).validates
    assert not known.model_copy(update={"n": 1}).validates
    assert not known.model_copy(update={"sd": None}).validates


def test_a_ratio_has_the_relative_deviations_of_both() -> None:
    """36.7 +- 11.2 over 7.7 +- 1.3: 4.766, and 30.5 % and 16.9 % together 34.9 %: 1.66."""
    stress = [find("walter_2022", "axial_stress", words) for words in ("mode II", "at 90 degrees")]
    assert ratio(*stress) == pytest.approx((36.7 / 7.7, 36.7 / 7.7 * math.hypot(11.2 / 36.7, 1.3 / 7.7)))
    assert math.isnan(ratio(find("nemeth_1985", "moment_arm", "at 30 deg"), stress[0])[1])


def test_the_least_number_of_specimens_is_unknown_where_one_is() -> None:
    chen = [find("chen_2016", "sarcomere_length", f"{CHEN}{angle}") for angle in ("50 deg", "110 deg")]
    assert least_specimens(chen) == 6
    assert least_specimens([*chen, find("nemeth_1985", "moment_arm", "at 30 deg")]) is None
    assert least_specimens([]) is None


def test_a_fact_that_is_not_there_alone_is_an_error() -> None:
    for condition in ("", "nowhere"):
        with pytest.raises(LookupError, match="facts instead of one for axial_stress of walter_2022"):
            find("walter_2022", "axial_stress", condition)
