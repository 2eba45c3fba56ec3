"""Scenes of several muscles: each is the case that it would be alone, and mistakes name file and key."""

import json
from pathlib import Path

import pytest

from fem_reference.effects.touching import MuscleContact
from fem_reference.foundations.errors import InputError
from fem_reference.scenes import casefile
from fem_reference.scenes.muscles import MusclesCase
from tests.scenes.bars import SCENE, written

RAMPED = (
    '[[effect]]\nname = "gravity"\ndensity = "1060 kg/m3"\nacceleration = "0, 0, -9.81 m/s^2"\n'
    "ramp = [{ frame = 0, amount = 1.0 }, { frame = 1, amount = 1.0 }]\n\n"
)
BESIDE = ("attachment", "fibres", "effect", "expect")
OWN = SCENE[SCENE.index("[muscle]") : SCENE.index("[[bone]]")]
ATTACHED = SCENE[SCENE.index("[[attachment]]") : SCENE.index("[[effect]]")]
FIBRES = SCENE[SCENE.index("[fibres.traced]") : SCENE.index("[frames]")]
EXPECTED = SCENE[SCENE.index("[[expect]]") : SCENE.index("[negative_control]")]
TOUCHING = '[[effect]]\nname = "touching"\nstiffness = "1 MPa/mm"\nsmoothing = "0.1 mm"\n\n'


def nested(name: str, own: str = "") -> str:
    """The muscle of the scene with all that is its own, as an entry of a list."""
    text = OWN.replace("[muscle]", f'[[muscle]]\nname = "{name}"')
    rest = (ATTACHED + FIBRES + EXPECTED).replace("[[", "[[muscle.").replace("[fibres", "[muscle.fibres")
    return text + rest + own


def several(*muscles: str) -> str:
    text = SCENE
    for part in (OWN, ATTACHED, FIBRES, EXPECTED):
        text = text.replace(part, "")
    return text.replace("[frames]", "".join(muscles) + "[frames]")


def test_a_list_of_one_muscle_is_that_muscle(bar: Path) -> None:
    plain = casefile.read(bar)
    listed = casefile.read(written(bar, several(nested("a"))))
    assert listed == plain
    assert listed.key == plain.key


def test_each_of_several_is_the_case_that_it_is_alone(bar: Path) -> None:
    plain = casefile.read(bar)
    stiff = '[[muscle.effect]]\nname = "viscosity"\neta = "1 Pa s"\n\n'
    own = several(nested("a"), nested("b", stiff)).replace("[frames]", TOUCHING + "[frames]", 1)
    case = casefile.read(written(bar, own))
    assert isinstance(case, MusclesCase)
    a, b = case.parts
    alone = {
        "name": "bar_a",
        "title": "A bar: a",
        "place": f"{case.place}: muscle[0]",
        "negative_control": plain.negative_control,
    }
    assert a.model_copy(update={key: getattr(plain, key) for key in alone}) == plain
    assert [type(one).__name__ for one in b.effects] == ["NeoHooke", "Incompressible", "Viscosity"]
    assert isinstance(case.touching, MuscleContact)
    assert list(case.acting) == ["NeoHooke", "Incompressible", "MuscleContact", "b: Viscosity"]


def test_the_key_changes_with_each_muscle_and_not_with_what_is_expected(bar: Path) -> None:
    texts = [several(nested("a"), nested("b"))]
    texts += [several(nested("b"), nested("a")), several(nested("a"), nested("b").replace('"2 cm"', '"3 cm"'))]
    keys = [casefile.read(written(bar, text)).key for text in texts]
    assert len(set(keys)) == 3
    expects = casefile.read(written(bar, texts[0].replace('within = "1 %"', 'within = "2 %"')))
    assert expects.key == keys[0]
    more = expects.expecting(expects.parts[0].expect)
    assert [len(part.expect) for part in more.parts] == [2, 2]
    assert json.dumps(more.determining()) == json.dumps(expects.determining())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (several(nested("a"), nested("a")), r'muscle: got "a" a second time|muscle.*"a"'),
        (several(nested("a"), nested("A")), r'muscle: got the name "a" twice'),  # one folder on some disks
        (several(nested("a"), nested("wall")), r'muscle.*"wall"'),
        (
            several(nested("a"), nested("b").replace('bone = "lever"', 'bone = "leg"')),
            r'muscle\[1\]\.attachment\[1\]\.bone: got "leg"',
        ),
        (
            several(nested("a"), nested("b", TOUCHING.replace("[[", "[[muscle."))),
            r"muscle\[1\]\.effect: got contact of one muscle",
        ),
        (
            several(nested("a"), nested("b").replace("tet_size", "tet_sise")),
            r"muscle\[1\]\.tet_sise: got an unknown key",
        ),
        (several(nested("a"), nested("b")) + EXPECTED, r"expect: got expectations of all muscles"),
        (
            several(nested("a"), nested("b", RAMPED.replace("[[", "[[muscle."))),
            r"toml: muscle\[1\]\.effect\[0\]\.ramp: got an amount of 1",
        ),
        (several(nested("a"), nested("b")) + RAMPED, r"toml: effect\[2\]\.ramp: got an amount of 1"),
        (several(nested("a")) + ATTACHED, r"attachment: got this key and muscle\[0\]\.attachment"),
    ],
)
def test_mistakes_name_the_muscle(bar: Path, text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        casefile.read(written(bar, text))


@pytest.mark.parametrize("name", ["/tmp/evil", "../evil", "a/b", "a b", ".a", "a.b", ""])
def test_the_name_of_a_muscle_is_that_of_a_folder_below_its_run_and_has_no_dot(bar: Path, name: str) -> None:
    """Scalars of a muscle "a" begin with "a.", as those of "a.b" would."""
    with pytest.raises(InputError, match=r"muscle\[1\]\.name: got .*, want a name"):
        casefile.read(written(bar, several(nested("a"), nested(name))))


def test_what_is_for_one_muscle_is_refused_for_several(bar: Path) -> None:
    case = casefile.read(written(bar, several(nested("a"), nested("b"))))
    with pytest.raises(InputError, match="a case of several muscles, want the case of a muscle"):
        casefile.muscle(case)


def test_what_is_expected_of_a_muscle_is_no_cause_of_its_verdict(bar: Path) -> None:
    case = casefile.read(written(bar, several(nested("a"), nested("b")) + TOUCHING))
    assert all(muscle.expect for muscle in case.muscle)
    none = case.model_copy(update={"muscle": tuple(one.model_copy(update={"expect": ()}) for one in case.muscle)})
    assert none.decides[:2] == case.decides[:2]
