"""Scenes are read strictly: every mistake is one message that names file and key."""

import math
import os
import tomllib
from pathlib import Path

import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.motion import RigidMotion
from fem_reference.geometry.rigid_bodies import CLOSED_FORMS
from fem_reference.problems.muscle import solid
from fem_reference.scenes import casefile
from fem_reference.scenes.case import DATA_SETTING, HOME
from tests.scenes.bars import PRESSURE, SCENE, SLIDE, changed, edited, refused

MUSCLE_KEYS = [
    "attachment",
    "bone",
    "candidate",
    "effect",
    "effects",
    "expect",
    "fibres",
    "frames",
    "joint",
    "muscle",
    "negative_control",
    "proves",
]
MUSCLE_KEYS += ["quick", "reference", "region", "title", "uncertain", "unsolved"]
# Solvers check their own settings.
OPTIONAL = ("interval", "newton_iterations", "stretch", "statistic", 'frame = "any"')
NEEDED = list(dict.fromkeys(line for line in SCENE.splitlines() if " = " in line and not line.startswith(OPTIONAL)))


def test_scene_has_what_the_file_says(bar: Path) -> None:
    scene = casefile.read(bar)
    assert (scene.name, scene.folder, scene.place) == ("bar", bar.resolve(), str(bar.resolve() / "case.toml"))
    assert (scene.muscle.unit, scene.muscle.tet_size) == pytest.approx((10.0, 20.0))
    assert scene.bone[0].motion is None
    assert scene.bone[1].motion is not None
    assert scene.bone[1].motion.poses() == RigidMotion(
        (0.0, 0.0, 2.0), (10.0, 20.0, 30.0), (0.0, 10.0), (0.0, pytest.approx(math.pi / 2))
    )
    assert scene.bone[1].motion.centre == pytest.approx((10.0, 20.0, 30.0))
    assert [effect.model_dump() for effect in scene.effects] == [
        {"mu": pytest.approx(0.03)},
        {"bulk": pytest.approx(30.0)},
    ]
    assert scene.frames.numbers == (0, 5, 10, 15, 20)
    assert scene.reference.settings == {"newton_iterations": 20}
    assert scene.candidate[0].settings == {"stretch": 1.0}


def test_folder_and_file_are_the_same_scene(bar: Path) -> None:
    assert casefile.read(bar) == casefile.read(bar / "case.toml") == casefile.read(str(bar))


def test_candidates_may_be_none(bar: Path) -> None:
    start, end = SCENE.index("[[candidate]]"), SCENE.index("[[expect]]")
    assert casefile.read(edited(bar, SCENE[start:end], "")).candidate == ()


def test_what_the_first_case_shows_in_comments_can_be_read(bar: Path) -> None:
    comments = [
        line[2:] for line in (HOME / "cases/hip_flexion/case.toml").read_text().splitlines() if line[:2] == "# "
    ]
    shown = [line for line in comments if line.split(" = ")[0] in CLOSED_FORMS]
    assert len(shown) == len(CLOSED_FORMS)
    for line in shown:
        assert solid(changed(bar, "bone[0]", {"name": "wall"} | tomllib.loads(line)).bone[0]) is not None
    slide = "\n".join(line for line in comments if line.split(" = ")[0] in ("direction", "keyframes"))
    assert changed(bar, "bone[1].motion", tomllib.loads(slide)).bone[1].motion is not None
    meshers = [line for line in comments if line.startswith("mesher = ")]
    muscle = {"surface": "bar.ply", "unit": "cm", "tet_size": "2 cm"} | tomllib.loads(meshers[0])
    assert changed(bar, "muscle", muscle).muscle.mesher == "block"


NAN = math.nan
# Key, what stands there instead, what the message says.
WRONG = [
    ("effect[0].mu", "30 mm", 'effect[0].mu: got "30 mm", want a pressure with its unit, such as "30 kPa"'),
    ("effect[0].mu", "-30 kPa", 'effect[0].mu: got "-30 kPa", want more than zero'),
    (
        "effect[0].name",
        "hooke",
        'effect[0].name: got "hooke", want one of active_tension, collagen_across, contact',
    ),
    ("effect", ["hooke"], 'effect[0].name: got "hooke", want one of active_tension, collagen_across, contact'),
    ("effect", "hooke", 'effect: got "hooke", want'),
    ("effect", [], "effect: got [], want"),
    ("effect[1]", {"name": "neo_hooke", "mu": "1 kPa"}, 'effect[1].name: got "neo_hooke" a second time, want every'),
    ("effect[1]", PRESSURE | {"on": "top"}, 'effect[1].on: got "top", want one of start, end, free'),
    (
        "effect[1]",
        {"name": "tendon", "on": "top", "stiffness": "1 N/mm", "reach": "1 mm"},
        'effect[1].on: got "top", want one of start, end, free',
    ),
    ("effect[1]", PRESSURE | {"on": "end"}, 'effect[1].on: got "end", which follows its bone exactly'),
    (
        "effect[1]",
        {"name": "membrane", "on": "end", "thickness": "1 mm", "mu": "1 MPa"},
        'effect[1].on: got "end", which follows its bone exactly',
    ),
    (
        "effect[0]",
        PRESSURE | {"ramp": [{"frame": 0, "amount": 0.5}]},
        "effect[0].ramp: got an amount of 0.5 at frame 0, the first, want 0 there, as the muscle is at rest",
    ),
    (
        "effect[0]",
        {"name": "contact", "stiffness": "1 kPa/mm", "support": "3 mm"},
        'effect[0].support: got 3 mm, want no "support" without "in_situ"',
    ),
    ("effect", [PRESSURE, PRESSURE], 'effect[1].name: got "pressure" on "free" a second time, want every effect once'),
    ("attachment[0].name", "free", 'attachment: got the name "free" twice, want every name once'),
    ("title", 3, "title: got 3, want a valid string"),
    (
        "bone[1].motion.keyframes[0].angle",
        "1 deg",
        "bone[1].motion: got a bone turned at the first frame, want an angle of 0",
    ),
    (
        "bone[1].motion",
        SLIDE | {"keyframes": [{"frame": 0, "distance": "2 mm"}, {"frame": 9, "distance": "1 mm"}]},
        "bone[1].motion: got a bone moved at the first frame, want a distance of 0",
    ),
    ("bone[1].name", "wall", 'bone: got the name "wall" twice, want every name once'),
    ("attachment[1].name", "start", 'attachment: got the name "start" twice, want every name once'),
    ("candidate[0].name", "reference", 'candidate: got the name "reference" twice, want every name once'),
    ("candidate[0].name", "a/b", 'candidate[0].name: got "a/b", want'),
    ("attachment[1].bone", "ulna", 'attachment[1].bone: got "ulna", want one of wall, lever'),
    ("fibres.traced.start", "middle", 'fibres.traced.start: got "middle", want one of start, end'),
    ("fibres.traced.end", "middle", 'fibres.traced.end: got "middle", want one of start, end'),
    ("expect[0].of", "slow", 'expect[0].of: got "slow", want one of reference, candidates, fast'),
    ("expect[0].kind", "hope", 'expect[0].kind: got "hope", want'),
    ("expect[0].frame", "last", 'expect[0].frame: got "last", want'),
    ("expect[0].frame", True, "expect[0].frame: got True, want"),
]


@pytest.mark.parametrize(("key", "value", "message"), WRONG, ids=lambda entry: str(entry)[:40])
def test_wrong_value_names_file_and_key(bar: Path, key: str, value: object, message: str) -> None:
    refused(bar, key, value, message)


@pytest.mark.parametrize("line", NEEDED)
def test_every_key_is_needed(bar: Path, line: str) -> None:
    with pytest.raises(InputError, match=r"case\.toml: "):
        casefile.read(edited(bar, line + "\n", ""))


@pytest.mark.parametrize(
    ("table", "place", "known"),
    [
        (
            'title = "A bar"\n',
            "colour",
            ", ".join(MUSCLE_KEYS),
        ),
        ("[muscle]\n", "muscle.colour", "mesher, refinements, surface, tet_size, unit"),
        (
            "[[bone]]\n",
            "bone[0].colour",
            "box, capsule, cylinder, distance_error, distance_rounding, half_space, motion, name, sphere, surface, unit",
        ),
        ("[[attachment]]\n", "attachment[0].colour", "bone, name, outline, stiffness, tendon, vertices, within"),
        ("[[effect]]\n", "effect[0].colour", "in, mu"),
        ("[fibres.traced]\n", "fibres.traced.colour", "count, end, flux, start"),
        ("[frames]\n", "frames.colour", "every, first, interval, last"),
        ("[[expect]]\n", "expect[0].colour", "because, frame, kind, metric, of, statistic, truth, within"),
        ("[negative_control]\n", "negative_control.colour", "because, key, value"),
    ],
)
def test_unknown_key_is_reported_the_known_ones(bar: Path, table: str, place: str, known: str) -> None:
    with pytest.raises(InputError) as caught:
        casefile.read(edited(bar, table, table + 'colour = "red"\n'))
    assert f"case.toml: {place}: got an unknown key, want one of {known}" in str(caught.value)


@pytest.mark.parametrize("key", ["name", "folder"])
def test_what_the_folder_says_is_no_key(bar: Path, key: str) -> None:
    with pytest.raises(InputError, match=rf"case\.toml: {key}: got an unknown key, want one of attachment, "):
        casefile.read(edited(bar, 'title = "A bar"\n', f'title = "A bar"\n{key} = "hip_flexion"\n'))


@pytest.mark.parametrize("text", [b"title = ", b"\xff\xfe"])
def test_text_that_is_no_toml(bar: Path, text: bytes) -> None:
    (bar / "case.toml").write_bytes(text)
    with pytest.raises(InputError, match="want a TOML file"):
        casefile.read(bar)


def test_case_that_is_not_there() -> None:
    with pytest.raises(InputError, match=r'CASE: got "nowhere", want a scene file, .* one of .*hip_flexion'):
        casefile.read("nowhere")


# Changes


def test_changes_replace_values(bar: Path) -> None:
    changed = casefile.read(
        bar, changes={"frames.last": 10, "effect[0].mu": "1 kPa", "bone[1].motion.keyframes[1].angle": "1 rad"}
    )
    assert changed.frames.numbers == (0, 5, 10)
    assert changed.effects[0] == casefile.read(bar, changes={"effect[0].mu": "0.001 MPa"}).effects[0]
    assert changed.bone[1].motion is not None
    assert changed.bone[1].motion.keyframes[1].angle == 1.0
    assert casefile.read(bar).frames.last == 20


def test_a_change_may_add_what_is_optional(bar: Path) -> None:
    assert casefile.read(bar, changes={"frames.interval": "10 ms"}).frames.interval == 0.01
    with pytest.raises(
        InputError, match=r"frames.intervall: got an unknown key, want interval, or another one of every"
    ):
        casefile.read(bar, changes={"frames.intervall": "10 ms"})


def test_all_that_is_wrong_with_keys_is_said_at_once(bar: Path) -> None:
    path = bar / "case.toml"
    path.write_text(path.read_text().replace("tet_size", "tetsize").replace('title = "A bar"\n', ""))
    with pytest.raises(InputError) as raised:
        casefile.read(bar)
    first, *others = str(raised.value).splitlines()
    assert "muscle.tetsize: got an unknown key, want tet_size, or another one of" in first
    assert sorted(line.split("case.toml: ")[1] for line in others) == [
        "muscle.tet_size: got nothing, want this key",
        "title: got nothing, want this key",
    ]


@pytest.mark.parametrize("key", ["", "effect[7].mu", "effect.mu", "frames.last.more", "title[0]"])
def test_change_of_a_key_that_is_not_there(bar: Path, key: str) -> None:
    with pytest.raises(InputError, match="got nothing, want a key that this scene has"):
        casefile.read(bar, changes={key: 1})


def test_a_muscle_in_situ_may_have_a_tone_and_supports_at_rest(bar: Path) -> None:
    tone = {"name": "fibre_active", "stress": "300 kPa", "optimal_stretch": 1.0, "ramp": [{"frame": 0, "amount": 0.02}]}
    contact = {"name": "contact", "stiffness": "1 kPa/mm", "support": "3 mm"}
    given = [{"name": "neo_hooke", "mu": "10 kPa"}, {"name": "in_situ", "stretch": 1.1}, tone, contact]
    scene = changed(bar, "effect", given)
    assert scene.effects[2].amount(0) == 0.02
    assert scene.effects[3].support == 3
    with pytest.raises(InputError, match=r'effect\[3\].friction: got 0.3, want no friction with "in_situ"'):
        changed(bar, "effect", [*given[:3], contact | {"friction": 0.3}])


def test_passive_fibres_are_slack_in_the_given_shape_but_in_situ(bar: Path) -> None:
    """Fibres that the given shape stretches would pull at the first frame, where a muscle rests."""
    matrix = {"name": "neo_hooke", "mu": "10 kPa"}
    law = {"name": "fibre_passive", "stress": "300 kPa", "p1": 0.05, "p2": 6.6, "linear_from": 1.4}
    for optimal in (1.0, 1.2):
        assert (
            changed(bar, "effect", [matrix, law | {"optimal_stretch": optimal}]).effects[1].optimal_stretch == optimal
        )
    tense = [matrix, law | {"optimal_stretch": 0.9}]
    with pytest.raises(
        InputError, match=r"effect\[1\]: got fibres under 18 kPa in the given shape, want slack fibres .*in_situ"
    ):
        changed(bar, "effect", tense)  # 300 kPa 0.05 (exp(6.6 (1 / 0.9 - 1)) - 1) / 0.9
    changed(bar, "effect", [*tense, {"name": "in_situ", "stretch": 1.05}])


def test_a_change_that_leads_nowhere_says_what_there_is(bar: Path) -> None:
    for key, wanted in {
        "bone.lid.unit": r"; there are bone\[0\] \(\w+\), bone\[1\] \(\w+\)$",
        "muscle.size.more": r"; there are surface, unit, tet_size",
        "frames.last.more": r"a table that it has$",
    }.items():
        with pytest.raises(InputError, match=wanted):
            casefile.read(bar, changes={key: 1})


# The shipped cases


@pytest.mark.parametrize("case", casefile.cases())
def test_shipped_case_reads_and_its_files_exist(case: str) -> None:
    text = (HOME / "cases" / case / "case.toml").read_text(encoding="utf-8")
    if '"data:' in text and DATA_SETTING not in os.environ:
        pytest.skip(f"its anatomy is in {DATA_SETTING}, which is not set")
    scene = casefile.read(case)
    assert scene.name == case
    assert all(one.expect for one in scene.parts or (scene,)), "a shipped case shows that its numbers are right"
    assert scene.negative_control, "and that they could be wrong"
    assert casefile.read(case, changes=scene.quick).quick == scene.quick
    changed = casefile.read(case, with_negative_control=True)
    assert len(scene.key) == 64
    assert (changed.key, changed.candidate) != (scene.key, scene.candidate)
    for i, candidate in enumerate(scene.candidate):
        if "folder" in candidate.settings:
            assert scene.file(candidate.settings["folder"], f"candidate[{i}].folder").is_dir()


def test_every_folder_of_cases_is_a_case() -> None:
    folders = sorted(path.name for path in (HOME / "cases").iterdir() if path.is_dir())
    assert casefile.cases() == [name for name in folders if name != "hard"]  # which has those of the verb stress


def test_a_case_of_ones_own_may_expect_nothing(bar: Path) -> None:
    file = edited(bar, SCENE[SCENE.index("[[expect]]") :], "")
    scene = casefile.read(file)
    assert (scene.expect, scene.negative_control) == ((), None)
    assert scene.key == casefile.read(file, changes={"title": "x"}).key
