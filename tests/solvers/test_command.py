"""A program of somebody else's: run without a shell, with all that it may do wrong as a status, and nothing old taken for new."""

import re
import shlex
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapes

from fem_reference import effects, solvers
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.motion import RigidMotion
from fem_reference.foundations.subprocesses import lives
from fem_reference.runs.store import Frame, Outcome
from fem_reference.scenes.case import SolverChoice
from fem_reference.solvers import command
from fem_reference.solvers.common.protocol import trades

MUSCLE = (effects.make("neo_hooke", mu="10 kPa"), effects.make("incompressible", bulk="10 MPa"))
TURN = RigidMotion((1, 0, 0), (5, 5, 0), (0.0, 10.0), (0.0, 0.3))
# A program without a package: the rest surface in every frame, and between its beginning and its end what a test writes.
PROGRAM = """
import json, pathlib, shutil, sys
scene, out = map(pathlib.Path, sys.argv[-2:])
frames = json.loads((scene / "scene.json").read_text())["frames"]
def write(frame):
    shutil.copy(scene / "muscle.ply", out / f"frame_{frame}.ply")
"""
ALL = "for frame in frames: write(frame)\n"


@pytest.fixture(scope="module")
def bar():
    return shapes.bar((2, 2, 4), (10, 10, 30), {"bottom": None, "top": TURN}, MUSCLE, (0, 5, 10))


def program(folder: Path, text: str = ALL, words: str = "{scene} {out}") -> str:
    """The command of a program that does what ``text`` says."""
    (folder / "mine.py").write_text(PROGRAM + text)
    return f"{shlex.quote(sys.executable)} mine.py {words}"


def settings(folder: Path, text: str, **more: object) -> command.CommandSettings:
    choice = SolverChoice(solver="command", command=text, directory=str(folder), **more)
    found = solvers.settings(choice, "test")
    assert isinstance(found, command.CommandSettings)
    return found


def solved(bar, chosen: command.CommandSettings) -> tuple[Outcome, list[Frame]]:
    frames: list[Frame] = []
    return command.solve(bar, chosen, frames.append), frames


def test_it_reads_the_scene_and_its_frames_are_read(bar, tmp_path) -> None:
    place = tmp_path / "with a blank"
    place.mkdir()
    text = 'import time; time.sleep(0.2)\nassert sys.argv[1:3] == ["7", "two words"], sys.argv\n' + ALL
    chosen = settings(place, program(place, text, "{count} '{title}' {scene} {out}"), count=7, title="two words")
    outcome, frames = solved(bar, chosen)
    assert outcome.status == "converged", outcome.message
    assert [frame.number for frame in frames] == [0, 5, 10]
    assert all(np.array_equal(frame.surface, bar.surface.points) for frame in frames)
    assert outcome.cost["seconds_processor"] > 0
    assert outcome.cost["seconds_solve"] == outcome.cost["seconds"] > 0
    assert outcome.cost["unknowns"] == 3 * (len(bar.surface.points) - len(np.unique(bar.attached_vertices)))


@pytest.mark.parametrize(
    ("text", "status", "message", "count"),
    [
        (
            ALL + "print('no convergence', file=sys.stderr); sys.exit(3)",
            "crashed",
            r"exit status 3 .*no convergence",
            3,
        ),
        ("write(0); import os; os.kill(os.getpid(), 11)", "crashed", "signal 11", 1),
        ("write(0); write(5)", "crashed", r"exit status 0, but {out}: got no frame 10 \(there are 2: 0 to 5\)", 2),
        ("", "crashed", "no frame 0, 5, 10", 0),
        (ALL + "(out / 'frame_5.ply').write_text('ply')", "crashed", "frame_5.ply", 1),
    ],
)
def test_what_a_program_does_wrong_is_a_status(bar, tmp_path, text, status, message, count) -> None:
    outcome, frames = solved(bar, settings(tmp_path, program(tmp_path, text)))
    assert outcome.status == status
    assert [frame.number for frame in frames] == [0, 5, 10][:count]
    assert f"{count} of 3 frames are kept" in outcome.message
    assert re.search(message, outcome.message), outcome.message


POSITIONS = """
import numpy as np, meshio
rest = meshio.read(scene / "muscle.ply")
for frame in frames:
    points = rest.points.copy()
    {}
    meshio.Mesh(points, rest.cells).write(out / f"frame_{{frame}}.ply")
"""


@pytest.mark.parametrize(
    ("line", "status", "message", "count"),
    [
        ("points[3] = np.nan if frame == 10 else points[3]", "diverged", r"not finite \(vertex 3\)", 2),
        ("points /= 1000", "crashed", "from the rest surface", 0),  # metres, which nobody has said
        ("points, rest.cells[0].data = points[1:], rest.cells[0].data % (len(points) - 1)", "crashed", "vertices", 0),
        ("points += [400, 0, 0]", "crashed", "from the rest surface", 0),  # of another scene
    ],
)
def test_frames_that_are_not_of_the_scene_are_not_taken(bar, tmp_path, line, status, message, count) -> None:
    outcome, frames = solved(bar, settings(tmp_path, program(tmp_path, POSITIONS.format(line))))
    assert (outcome.status, len(frames)) == (status, count), outcome.message
    assert re.search(message, outcome.message), outcome.message


@pytest.mark.slow
def test_the_unit_is_that_of_the_settings_or_of_the_frames(bar, tmp_path) -> None:
    told = "\n(out / 'candidate.toml').write_text('unit = \"m\"')"
    for text, more in (
        (POSITIONS.format("points /= 1000"), {"unit": "m"}),
        (POSITIONS.format("points /= 1000") + told, {}),
    ):
        outcome, frames = solved(bar, settings(tmp_path, program(tmp_path, text), **more))
        assert outcome.status == "converged", outcome.message
        assert frames[-1].surface == pytest.approx(bar.surface.points, abs=1e-12 * 30)
    outcome, _ = solved(bar, settings(tmp_path, program(tmp_path, ALL + told), unit="mm"))
    assert outcome.status == "crashed"
    assert 'unit: got "m"' in outcome.message


def test_frames_that_an_earlier_run_has_left_are_not_read(bar, tmp_path) -> None:
    chosen = settings(tmp_path, program(tmp_path, "if not list(out.iterdir()) and not pathlib.Path('ran').exists():\n"
        "    pathlib.Path('ran').touch()\n    for frame in frames: write(frame)\n"))  # fmt: skip
    assert solved(bar, chosen)[0].status == "converged"
    assert solved(bar, chosen)[0].status == "crashed"


def test_the_time_of_frames_alone_is_what_the_program_states_unless_it_cannot_be(bar, tmp_path) -> None:
    told = "(out / 'candidate.toml').write_text('seconds_per_frame = {}\\nthreads = 2')"
    outcome, _ = solved(bar, settings(tmp_path, program(tmp_path, ALL + told.format("1e-6"))))
    assert outcome.cost["seconds_solve"] == pytest.approx(1e-5)  # ten frame numbers
    assert outcome.cost["seconds"] > 1e-3
    assert outcome.cost["threads"] == 2
    outcome, _ = solved(bar, settings(tmp_path, program(tmp_path, ALL + told.format("1000"))))
    assert outcome.status == "crashed"
    assert "at most the" in outcome.message


def test_a_program_that_does_not_take_the_scene_is_not_one_that_crashed(bar, tmp_path) -> None:
    refuses = settings(tmp_path, program(tmp_path, "print('no tetrahedra'); sys.exit(77)"))
    with pytest.raises(InputError, match="got no tetrahedra, want a scene that the program supports"):
        solved(bar, refuses)


@pytest.mark.parametrize("session", [False, True])
def test_no_process_of_a_program_outlives_its_limit(bar, tmp_path, session) -> None:
    """One of its own works, the other waits, in a session of its own or not."""
    text = f"""
write(0)
import subprocess
work = "while True: pass"
both = work, "import time; time.sleep(60)"
others = [subprocess.Popen([sys.executable, "-c", one], start_new_session={session}) for one in both]
pathlib.Path("others").write_text(" ".join(str(one.pid) for one in others))
others[0].wait()
"""
    chosen = settings(tmp_path, program(tmp_path, text), time_limit="0.5 s")
    outcome, frames = solved(bar, chosen)
    assert (outcome.status, len(frames)) == ("timed out", 1), outcome.message
    _all_ended(tmp_path / "others")


def test_no_process_of_a_program_outlives_its_end(bar, tmp_path) -> None:
    text = (
        ALL
        + """
import subprocess
other = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
pathlib.Path("others").write_text(str(other.pid))
"""
    )
    assert solved(bar, settings(tmp_path, program(tmp_path, text)))[0].status == "converged"
    _all_ended(tmp_path / "others")


def _all_ended(file: Path) -> None:
    numbers, begin = [int(number) for number in file.read_text().split()], time.monotonic()
    while any(lives(number) for number in numbers):
        assert time.monotonic() - begin < 5, "a process is left"
        time.sleep(0.02)


def test_a_program_that_only_waits_says_nothing_of_what_was_solved(bar, tmp_path) -> None:
    outcome, _ = solved(bar, settings(tmp_path, program(tmp_path, "import time; time.sleep(60)"), time_limit="0.15 s"))
    assert outcome.status in ("stalled", "timed out")  # its start takes some of this


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("mine {scene} {out} {n", 'command: got "{n", want a program, with settings such as'),
        ("mine {scene} {out} {n:03d}", "want a program, with settings such as"),
        ("mine {scene} {}", "want a program, with settings such as"),
        ("mine {scene} 'unclosed", "a command that a shell can parse: No closing quotation"),
        ("mine {out}", "want {scene} in it"),
        ("mine {scene}", "want {out} in it"),
        ("", "a program, with settings"),
        ("mine {scene} {out} {count}", "count: got nothing, want this key"),
        ("mine {scene} {out} {unit}", 'command: got "{unit}", want another name for the setting'),
        ("mine {scene} {out} {copy}", 'command: got "{copy}", want another name for the setting'),
        (
            "mine {scene} {out} {precision}",
            'command: got "{precision}", want another name for the setting',
        ),  # in no key
        ("mine {scene} {out} {ranks}", 'command: got "{ranks}", want another name for the setting'),
        ("mine {scene} {out} {folder}", 'command: got "{folder}", want another name for the setting'),  # of a scene
    ],
)
def test_a_command_that_cannot_be_filled_in_is_refused(text, problem) -> None:
    with pytest.raises(InputError, match=re.escape(problem)):
        solvers.settings(SolverChoice(solver="command", command=text), "test")


def test_settings_and_ladders_that_the_command_does_not_mention_are_refused() -> None:
    good = {"command": "mine {count} {scene} {out}", "count": 3, "ladder": {"count": [1, 3, 9]}}
    chosen = solvers.settings(SolverChoice(solver="command", **good), "test")
    assert trades(type(chosen)) == {"count": (1, 3, 9)}
    for changes, problem in (
        ({"speed": 3}, "test.speed: got an unknown key"),
        ({"ladder": {"speed": [1, 2]}}, "test.ladder.speed: got a setting that the command does not mention"),
        ({"count": True}, "test.count: got True"),
        ({"command": 3}, "test.command: got 3"),
    ):
        with pytest.raises(InputError, match=re.escape(problem)):
            solvers.settings(SolverChoice(solver="command", **good | changes), "test")


def test_there_is_no_such_program(tmp_path) -> None:
    (tmp_path / "data").write_text("")
    for word in ("./mine", "./data", "no-such-program"):
        with pytest.raises(InputError, match=f'command: got "{word}", want a program in'):
            command.require(settings(tmp_path, f"{word} {{scene}} {{out}}"))


def test_a_changed_program_is_another_one(tmp_path) -> None:
    """Also by a file that it imports, by data that the command or ``files`` names, and by its version."""
    text = program(tmp_path, words="weights.txt {scene} {out}")
    (tmp_path / "weights.txt").write_text("1")
    (tmp_path / "data").mkdir()

    def found(**more: object) -> object:
        return settings(tmp_path, text, files=["data"], **more).model_dump(mode="json")

    seen = [found()]
    assert found() == seen[0]
    for name in ("mine.py", "helper.py", "weights.txt", "data/table.csv"):
        (tmp_path / name).write_text("changed")
        seen.append(found())
    seen += [found(version="2"), found(unit="m")]
    assert len({str(one) for one in seen}) == len(seen)
    same = found(time_limit="3 s") | {"time_limit": 600.0}  # which no key contains
    assert same == seen[4]
    with pytest.raises(InputError, match=r'files: got "gone"'):
        command.require(settings(tmp_path, text, files=["gone"]))


@pytest.mark.parametrize("words", ["--config {config}", "--config={config}", "--set=config=in/{stem}.toml"])
def test_a_changed_file_that_a_setting_or_an_option_names_is_another_program(tmp_path, words) -> None:
    text = program(tmp_path, words=f"{words} {{scene}} {{out}}")
    given = {name: value for name, value in (("config", "in/one.toml"), ("stem", "one")) if f"{{{name}}}" in words}
    (tmp_path / "in").mkdir()
    seen = set()
    for content in ("1", "2"):
        (tmp_path / "in" / "one.toml").write_text(content)
        seen.add(settings(tmp_path, text, **given).program)
    assert len(seen) == 2


def test_packages_below_a_python_program_belong_to_it(tmp_path) -> None:
    """Other than caches, hidden folders and virtual environments; a module that moves is another one."""
    text = program(tmp_path)
    for place in ("pack/deep", "__pycache__", ".hidden", "env/lib"):
        (tmp_path / place).mkdir(parents=True)
    (tmp_path / "env" / "pyvenv.cfg").write_text("")
    (tmp_path / "pack" / "gone.py").symlink_to(tmp_path / "nowhere.py")
    first = settings(tmp_path, text).program
    for place in ("__pycache__", ".hidden", "env", "env/lib"):
        (tmp_path / place / "module.py").write_text("")
        assert settings(tmp_path, text).program == first, place
    (tmp_path / "pack" / "deep" / "module.py").write_text("")
    deep = settings(tmp_path, text).program
    (tmp_path / "pack" / "deep" / "module.py").rename(tmp_path / "pack" / "module.py")
    assert len({first, deep, settings(tmp_path, text).program}) == 3


def test_candidate_toml_describes_the_command(tmp_path) -> None:
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "mine.py").write_text("")
    about = tmp_path / "own" / "candidate.toml"
    text = "python own/mine.py -n {count} {scene} {out}"
    with pytest.raises(InputError, match=r"candidate.toml: settings.count: got nothing, want the value of {count}"):
        command.choice(text, tmp_path, "--solver-command")
    about.write_text('name = "own"\nunit = "cm"\n[settings]\ncount = 3\n[ladder]\ncount = [1, 3]\n')
    found = command.choice(text, tmp_path, "--solver-command")
    assert (found.name, found.solver, found.settings["count"]) == ("own", "command", 3)
    assert solvers.settings(found, "test").unit == 10
    for more, problem in (
        ("speed = [1]", "ladder.speed: got a setting that the command does not mention, want one of these: count"),
        ("[other]", "other: got an unknown key"),
        ("[settings.more]", "settings"),
    ):
        about.write_text(f"[settings]\ncount = 3\n[ladder]\n{more}\n")
        with pytest.raises(InputError, match=re.escape(problem)):
            command.choice(text, tmp_path, "--solver-command")
    about.write_text("seconds_per_frame = 0.1\n[settings]\ncount = 3\n")
    with pytest.raises(InputError, match="time is measured"):
        command.choice(text, tmp_path, "--solver-command")


def test_a_body_that_does_not_begin_at_rest_is_not_asked_for(bar, tmp_path) -> None:
    with pytest.raises(InputError, match="does not start at rest"):
        solved(replace(bar, start=lambda points: points + 1), settings(tmp_path, program(tmp_path)))
