"""Unknown parameters of a case that leaves effects out: keys count in its file, in all that is made of them."""

from pathlib import Path

import pytest
import random_scenes
from auto_scenes import ACTIVE, STILL, pennate

from fem_reference.foundations.errors import InputError
from fem_reference.scenes.muscle import MuscleCase, Uncertain
from fem_reference.studies.calibration import chosen
from fem_reference.studies.campaign import Workers
from fem_reference.studies.uncertainty import study
from fem_reference.studies.unknowns import unknowns

STRESS = Uncertain(key="effect[3].stress", low="200 kPa", high="400 kPa", source="made up")


@pytest.fixture
def auto(tmp_path: Path) -> MuscleCase:
    """A bar far away from a ball, so that the third of its four effects, contact, is left out."""
    contact = random_scenes.EFFECTS["contact"].format(**STILL, contact=500.0)
    case = pennate(tmp_path / "scene", "auto", contact + ACTIVE)
    return case.model_copy(update={"uncertain": (STRESS,)})


def test_keys_count_in_the_file_whatever_is_left_out(auto: MuscleCase) -> None:
    varied = unknowns(auto)
    assert varied.kept == (0, 1, 3)
    stress = varied.parameters()[-1]
    assert (stress.key, stress.title, stress.low, stress.high) == (STRESS.key, "fibre_active stress", 0.2, 0.4)
    made = varied.at({STRESS.key: 0.25, "effect[0].mu": 0.015})
    titles = [effect.title for effect in made.effects]
    assert (
        titles
        == [effect.title for effect in varied.case.effects]
        == ["NeoHooke", "IncompressiblePenalty", "FibreActive"]
    )
    assert (made.effects[0].mu, made.effects[2].stress) == (0.015, 0.25)
    assert made.choice == "listed", "the same effects act in all runs"
    assert not any("contact" in title for title in varied.fixed())


@pytest.mark.slow
def test_a_range_of_an_effect_that_is_left_out_is_refused(auto: MuscleCase, tmp_path: Path) -> None:
    soft = Uncertain(key="effect[2].stiffness", low="10 kPa/mm", high="20 kPa/mm", source="made up")
    case = auto.model_copy(update={"uncertain": (STRESS, soft)})
    want = r'uncertain\[1\]\.key: got "effect\[2\]\.stiffness", of contact stiffness, which this case leaves out, want'
    with pytest.raises(InputError, match=want):
        study(case, tmp_path / "runs", Workers(), runs=4)
    want = r'--fit: got "effect\[2\]\.stiffness" \(contact stiffness\), a parameter of an effect that this case'
    with pytest.raises(InputError, match=want):
        chosen(unknowns(auto), ["effect[2].stiffness"])
    listed = case.model_copy(update={"choice": "listed"})
    assert soft.key in [one.key for one in unknowns(listed).parameters()]
