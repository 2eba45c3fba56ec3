"""Files of hard cases: every folder is whole, and a mistake is named with its key; and the settings of their solvers."""

import pytest
from hard_cases import CASES

from fem_reference import solvers
from fem_reference.foundations.errors import InputError
from fem_reference.studies.hard import records


def test_every_folder_is_there_and_every_case_has_a_name_of_its_own() -> None:
    assert {name.partition(".")[0] for name in CASES} == set(records.folders())
    assert len(CASES) == len(records.read_all())


def test_a_name_that_is_not_there() -> None:
    with pytest.raises(InputError, match=r"NAME: got \"nothing\", want one of activation, at_rest"):
        records.read_all(("nothing",))


@pytest.mark.parametrize("hard", [hard for hard in CASES.values() if hard.block], ids=lambda hard: hard.name)
def test_every_setting_that_a_case_changes_is_one_of_its_solver(hard) -> None:
    assert set(hard.settings) <= set(records.choices())
    assert set(hard.only) <= set(records.choices())
    for choice in records.choices().values():
        solvers.settings(hard.choice(choice), hard.place, records.task_of(choice.solver, "solve"))


BLOCK = """
title = "a"
healthy = "b"
bound = [{ quantity = "from_rest", at_most = 1 }]
block = { size = "20, 20, 60 mm", cells = [2, 2, 3] }
hold = [{ face = "z0" }]
frames = { first = 0, last = 2, every = 1 }
"""
CONTACT = 'effect = [{ name = "contact", stiffness = "500 kPa/mm", bones = ["d"] }]\n'
SPHERE = 'bone = [{ name = "c", sphere = { centre = "0, 0, 200 mm", radius = "5 mm" } }'
BESIDE = 'beside = [{ name = "c", block = { size = "9, 9, 9 mm", cells = [1, 1, 1] }, hold = [] }]\n'
ROD = 'title = "a"\nhealthy = "b"\nbound = [{ quantity = "overshoot", at_most = 1 }]\n'


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[2, 2, 3]", "[2000, 2000, 2000]", "block: got .*want at most 50000 cells"),
        ("[2, 2, 3]", "[2, 2, 3], fibre = [0, 0, 0]", "block: got .*want a fibre that has a direction"),
        ("[2, 2, 3]", '[2, 2, 3], points_apart = "-1 mm"', "block.points_apart: got .*want more than zero"),
        ("at_most = 1", "at_most = -1", r"bound\[0\].at_most: got -1"),
        ("from_rest", "overshoot", r"bound\[0\].quantity: got .*want overshoot for a scalar field, and only for one"),
        ('{ face = "z0" }', '{ face = "z0" }, { face = "z0" }', "hold: got .*want every face at most once"),
        ("frames", 'contrast = "c"\nno_solution = "d"\nframes', 'contrast: got "c", want no contrast with "no_solution"'),
        ("frames", 'settings = { pdb = { damping = 1 } }\nframes', 'settings.pdb: got "pdb", want one of fenicsx'),
        ("frames", "settings = { pbd = { dampong = 1 } }\nframes", "settings.pbd.dampong: got an unknown key, want damping"),
        ("frames", 'settings = { pbd = { solver = "xpbd" } }\nframes', "settings.pbd.solver: got an unknown key"),
        ("frames", 'only = ["pdb"]\nbecause = "c"\nframes', r'only\[0\]: got "pdb", want one of fenicsx'),
        ("frames", "steps = { until = 3 }\nframes", "steps.until: got 3, want a frame after 0, up to 2"),
        ("frames", "steps = { until = 0 }\nframes", "steps.until: got 0, want a frame after 0, up to 2"),
        ("frames", "steps = { until = 2, counts = [0] }\nframes", r"steps.counts\[0\]: got 0, want greater than 0"),
        ("frames", "steps = { until = 2, counts = [] }\nframes", r"steps.counts: got \[\]"),
        ("frames", 'effect = [{ mu = "1 kPa" }]\nframes', r"effect\[0\].name: got .*want one of active_tension"),
        ("frames", 'effect = [{ name = "neo_hooke", nu = 1 }]\nframes', r"effect\[0\].nu: got an unknown key, want one of in, mu"),
        ("frames", 'bone = [{ name = "c", surface = "c.ply", unit = "mm" }]\nframes', "bone: got .*want bones in closed form"),
        ("frames", CONTACT + SPHERE + "]\nframes", r'effect\[0\].bones: got "d", want one of c'),
        ("frames", SPHERE + SPHERE.replace("bone = [", ", ") + "]\nframes", 'bone: got the name "c" twice'),
        ("frames", 'effect = [{ name = "inertia", density = "1 g/ml" }]\nframes', "frames.interval: got nothing, want the time"),
        ("frames", BESIDE + "start = { kind = 'point' }\nframes", 'want "beside" with a "block", without a "start"'),
        ("frames", BESIDE.replace('"c"', '"block"') + "frames", 'no body named "block", the name of the first'),
        ("frames", BESIDE.replace("hold", "effect = [{ mu = 1 }], hold") + "frames", r"beside\[0\].effect\[0\].name: got"),
        ("frames", BESIDE.replace("cells", "cell") + "frames", r"beside\[0\].block.cell: got an unknown key"),
        ("frames", "beside = 3\nframes", "beside: got 3"),
        (
            "frames",
            BESIDE.replace("hold", 'effect = [{ name = "touching", stiffness = "1 MPa/mm", smoothing = "1 mm" }], hold') + "frames",
            'want "touching" among the effects of the first block',
        ),
        ("frames", "variant = 3\nframes", "variant: got 3, want a list of tables"),
        ("frames", "variant = [3]\nframes", r"variant: got \[3\], want a list of tables"),
        ("frames", "variant = []\nframes", r"variant: got \[\], want a list of tables"),
        ("frames", 'variant = [{ title = "c" }]\nframes', r"variant\[0\].name: got '', want a unique name"),
        ("frames", 'variant = [{ name = "c" }, { name = "c" }]\nframes', r"variant\[1\].name: got 'c', want a unique name"),
        ("frames", 'variant = [{ name = "<b>" }]\nframes', r'variant\[0\].name: got "hard.<b>"'),
        ("frames", 'name = "c"\nframes', "name: got an unknown key"),
        ("frames", f"x = {'[' * 5000}{']' * 5000}\nframes", "case.toml: got tables or lists more than 32 deep"),
        (BLOCK, ROD + 'shipped = { case = "nothing" }', 'CASE: got "nothing"'),
        (BLOCK, ROD + 'shipped = { case = "rod", changes = { "a.b" = 1 } }', "a.b: got nothing, want a key"),
        (BLOCK, ROD.replace("overshoot", "volume") + 'shipped = { case = "rod" }', r'bound\[0\].quantity: got "volume"'),
        (BLOCK, ROD + 'shipped = { case = "rod" }\nsteps = { until = 1 }', "steps.until: got 1"),
    ],
)  # fmt: skip
def test_a_mistake_in_a_file_is_no_refusal_by_a_solver(old, new, message, tmp_path) -> None:
    path = tmp_path / "hard" / "case.toml"
    path.parent.mkdir()
    path.write_text(BLOCK)
    assert [hard.name for hard in records.read(path)] == ["hard"]
    path.write_text(BLOCK.replace(old, new, 1))
    with pytest.raises(InputError, match=message):
        list(records.read(path))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('title = "a"\nhealthy = "b"\n[[bound]]\nquantity = "colour"\nat_most = 1', "colour is not one of them"),
        ('title = "a"\nhealthy = "b"', "bound: got nothing"),
        ("title = ", "a TOML file"),
    ],
)
def test_a_wrong_file_is_refused(text, message, tmp_path) -> None:
    (tmp_path / "case.toml").write_text(text)
    with pytest.raises(InputError, match=message):
        list(records.read(tmp_path / "case.toml"))


def test_the_reference_comes_first_and_every_solver_of_muscles_is_there() -> None:
    found = records.choices()
    assert list(found)[:2] == [records.REFERENCE, records.SECOND]
    assert set(solvers.names("solve")) - {"recorded", "command"} <= set(found)
    assert "recorded" not in found


@pytest.mark.parametrize(
    ("solver", "task", "asked"),
    [("pbd", "solve", "solve"), ("scikit_fem", "solve", "solve_body"), ("scikit_fem", "solve_field", "solve_field")],
)
def test_each_is_asked_for_what_it_solves(solver: str, task: str, asked: str) -> None:
    assert records.task_of(solver, task) == asked
    assert solvers.find(solver, "here", asked).task == asked
