"""What a muscle, its bones and its effects must have in common; ``test_casefile.py`` asks it of whole scenes."""

import pytest

from fem_reference.effects import make
from fem_reference.foundations.errors import InputError
from fem_reference.scenes.consistency import check_acting
from fem_reference.scenes.muscle import Frames

FRAMES = Frames(first=0, last=1, every=1)


def test_bones_have_a_name_each_and_contact_is_with_some_of_them() -> None:
    contact = make("contact", stiffness="1 MPa/mm", bones=["femur"])
    check_acting((contact,), ["femur", "pelvis"], FRAMES, "case")
    with pytest.raises(InputError, match=r'effect\[0\]\.bones: got "femur"'):
        check_acting((contact,), ["pelvis"], FRAMES, "case")
    with pytest.raises(InputError, match=r'case\.bone.*"pelvis"'):
        check_acting((), ["pelvis", "pelvis"], FRAMES, "case")


def test_effects_of_time_need_an_interval() -> None:
    with pytest.raises(InputError, match=r"frames\.interval: got nothing"):
        check_acting((make("viscosity", eta="1 kPa s"),), ["femur"], FRAMES, "case")
