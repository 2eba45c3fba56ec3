"""Contents of a case in words and numbers: bones in closed form, their motions, attachments, effects and frames."""

import pytest
import small

from fem_reference.problems import of_case
from fem_reference.problems.description import contents
from fem_reference.scenes import casefile


@pytest.fixture
def bar(tmp_path):
    return casefile.read(small.write(tmp_path / "bar"))


def test_a_muscle_has_its_bones_attachments_effects_and_frames(bar) -> None:
    found = contents(of_case.setup(bar), bar)
    assert list(found)[:5] == ["muscle", "bones", "attachments", "effects", "frames"]
    assert found["muscle"]["tet_size_mm"] == bar.muscle.tet_size
    assert "turns about (5, 5, 30) mm along" in found["bones"]["lid"]
    assert list(found["attachments"]) == [one.name for one in bar.attachment]
    assert all(" mm2, attached to " in text for text in found["attachments"].values())
    assert list(found["effects"]) == [effect.title for effect in bar.effects]
    assert found["frames"] == f"{bar.frames.first} to {bar.frames.last}, every {bar.frames.every}"


def test_a_field_has_its_domain_element_and_form() -> None:
    rod = casefile.read("rod")
    found = contents(of_case.setup(rod), rod)
    assert list(found) == ["domain", "element", "form", "effects"]
    assert "mesh Peclet number up to" in found["form"]


def test_what_is_no_setup_has_no_contents(bar) -> None:
    with pytest.raises(TypeError, match="str is no setup of bar"):
        contents("bar", bar)
