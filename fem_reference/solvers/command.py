"""Your own solver as a command, which reads the scene from one folder and writes its frames into another folder.

The command is started once for each run, without a shell. ``{scene}`` stands for the folder with the scene, in the form that
``export`` writes; ``{out}`` for an empty folder, into which the command writes its frames; and other names in braces for settings.
A scene file cannot select this solver, because reading a scene must not start a program.
"""

import hashlib
import inspect
import os
import re
import shlex
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import cloudpickle
import numpy as np
from pydantic import ConfigDict, Field, computed_field, create_model

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Name, Record, join, parse
from fem_reference.foundations.subprocesses import scratch_folder
from fem_reference.foundations.units import LengthUnit, Time, length_unit
from fem_reference.io import files, texts
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.runs.contents import Status
from fem_reference.runs.store import Outcome, Sink
from fem_reference.scenes.case import COMMAND, MACHINE_ONLY, Candidate, SolverChoice
from fem_reference.solvers import recorded
from fem_reference.solvers.common import open_formats, programs
from fem_reference.solvers.common.protocol import Moves, MuscleSolver, Trade

_PLACEHOLDER = re.compile(r"\{([A-Za-z]\w*)\}")
FOLDERS = ("scene", "out")
REFUSED = 77  # the exit status of a program that does not support a scene, as for skipped tests in Automake
# The code of a separate Python process, which calls a pickled function with the folders.
_CALL = "import pathlib, pickle, sys; a = [*map(pathlib.Path, sys.argv[1:])]; pickle.loads(a[0].read_bytes())(*a[1:])"
Value = int | float | str


class CommandSettings(Record):
    """The command line, and a value for each setting in it.

    ``unit``: the unit of length of the frames, by default the unit in a ``candidate.toml`` next to the frames, otherwise mm.
    ``version``: the version of the program. ``files``: files and folders that determine the results, in addition to those that the
    command names. ``moves``: the mesh whose points the program moves. ``time_limit``: the limit on processor time. In Python only,
    ``directory``: the working directory; ``ladder``: for some settings, values from the fastest to the most accurate.
    """

    model_config = ConfigDict(protected_namespaces=())
    command: str
    unit: LengthUnit | None = None
    version: Name | None = None
    files: tuple[str, ...] = ()
    moves: Literal["surface", "tetrahedra"] = "surface"
    time_limit: Time = 600.0
    directory: str = Field(default=".", exclude=True)
    ladder: dict[str, tuple[Value, ...]] = Field(default_factory=dict, exclude=True)

    @property
    def place(self) -> Path:
        """The folder in which the program runs."""
        return Path(self.directory).absolute()

    @computed_field  # type: ignore[prop-decorator]
    @property
    def program(self) -> str:
        """A hash over the files in :func:`sources`. It is a part of the key of a run."""
        digest = hashlib.sha256()
        for path in sources(self):
            name = path.relative_to(self.place) if path.is_relative_to(self.place) else path.name
            digest.update(str(name).encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest())
        return digest.hexdigest()[:16]


def sources(settings: CommandSettings) -> list[Path]:
    """The files that determine the results: the program; the files that the command names, including those after a ``=`` or in the
    value of a setting; for each Python file among them, all Python files in the same folder and its subfolders; and the entries of
    ``files``. Raises InputError if one of these entries does not exist.
    """
    directory, words = settings.place, _filled(settings, {})
    program = programs.found(words[0], directory)
    ends = [word.split("=", count)[-1] for word in words[1:] for count in range(word.count("=") + 1)]
    named = [directory / end for end in ends] + ([] if program is None else [program])
    found = {path for path in named if path.is_file()}
    for name in settings.files:
        path = directory / name
        if not path.exists():
            raise InputError("files", f'"{name}", which is not at {path}', "a file or folder that exists")
        found |= {path} if path.is_file() else {one for one in path.rglob("*") if one.is_file()}
    for folder in {path.parent for path in found if path.suffix == ".py"}:
        found |= programs.modules(folder)
    return sorted(path for path in found if "__pycache__" not in path.parts)


def _filled(settings: CommandSettings, places: Mapping[str, Path]) -> list[str]:
    """The words of the command, in which settings are replaced by their values and folders by their paths in ``places``."""
    values = {key: str(value) for key, value in (*settings, *places.items())}
    words = shlex.split(settings.command)
    return [_PLACEHOLDER.sub(lambda found: values.get(found[1], found[0]), word) for word in words]


class Description(recorded.About):
    """The contents of a ``candidate.toml`` next to a program. ``settings``: the values of the settings in the command. ``files``,
    ``ladder``, ``moves``, ``time_limit``: as in :class:`CommandSettings`. ``law``: the effect that the program uses as its material
    law, on linear tetrahedra, with a Poisson's ratio of at most the setting ``poisson``. ``takes``: further effects that it models.
    """

    settings: dict[str, Value] = Field(default_factory=dict)
    ladder: dict[str, tuple[Value, ...]] = Field(default_factory=dict)
    files: tuple[str, ...] = ()
    moves: str | None = None
    time_limit: str | None = None
    law: str | None = None
    takes: tuple[str, ...] = ()


def choice(command: str, directory: Path, place: str) -> Candidate:
    """A candidate that runs ``command`` in ``directory``, described by a ``candidate.toml``: the first that is found next to a file
    in the command, otherwise the one in the directory. ``place``: the name of the command in messages.
    """
    names = placeholders(command, place)
    _check_program(command, directory, place)
    named = [path.parent for word in shlex.split(command) if (path := directory / word).is_file()]
    places = [folder / recorded.ABOUT for folder in (*named, directory)]
    file = next((path for path in places if path.exists()), places[-1])
    said = parse(Description, texts.toml(file), str(file)) if file.exists() else Description()
    if said.seconds_per_frame is not None or said.threads is not None:
        want = f"neither here: time is measured, or stated by a {recorded.ABOUT} that the command writes"
        raise InputError(file, "seconds_per_frame or threads", want)
    for key in [*said.settings, *said.ladder]:
        _check_named(key, names, f"{file}: {'settings' if key in said.settings else 'ladder'}")
    for key in names:
        if key not in said.settings:
            raise InputError(f"{file}: settings.{key}", "nothing", f"the value of {{{key}}} in the command")
    given = said.model_dump(include={"unit", "version", "files", "moves", "time_limit", "ladder"}, exclude_none=True)
    given |= {"name": said.name or "my_solver", "solver": COMMAND, "command": command, "directory": str(directory)}
    return parse(Candidate, given | said.settings, place)


def of_function(function: Callable[..., None], given: Mapping[str, Any], folder: Path) -> SolverChoice:
    """A command that calls ``function(scene, out, **settings)`` in another Python process. ``given``: values of the settings, and
    keys of :class:`CommandSettings`. ``folder``: the folder into which the function and the values of its settings are written.
    """
    own = {key: value for key, value in given.items() if key in CommandSettings.model_fields}
    called = partial(function, **{key: value for key, value in given.items() if key not in own})
    content = cloudpickle.dumps(called)
    name = f"{re.sub(r'\W', '', function.__name__)}-{hashlib.sha256(content).hexdigest()[:16]}.pickle"
    path = (folder / name).absolute()
    files.make_folder(folder)
    path.write_bytes(content)
    paths = os.pathsep.join(str(Path(one).absolute()) for one in sys.path)
    words = ["env", f"PYTHONPATH={paths}", sys.executable, "-P", "-c", _CALL, str(path)]
    source = inspect.getsourcefile(inspect.unwrap(function)) if inspect.isroutine(function) else None
    more = [source] if source is not None and Path(source).is_file() else []
    listed = {"command": f"{shlex.join(words)} {{scene}} {{out}}", "files": [*own.pop("files", []), *more]}
    return SolverChoice(**{"solver": COMMAND, **own, **listed})


def placeholders(command: str, place: str) -> tuple[str, ...]:
    """The names of the settings in a ``command``. Raises InputError if the command cannot be split into words, lacks a folder
    (``{scene}`` or ``{out}``), has braces without a name, or has a setting with a reserved name.
    """
    where = join(place, "command")
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise InputError(where, f'"{command}"', f"a command that a shell can parse: {error}") from error
    strange = [word for word in words if set("{}") & set(_PLACEHOLDER.sub("", word))]
    if not words or strange:
        raise InputError(where, f'"{strange[0] if words else ""}"', "a program, with settings such as {iterations}")
    names = tuple(dict.fromkeys(name for word in words for name in _PLACEHOLDER.findall(word)))
    for folder in FOLDERS:
        if folder not in names:
            raise InputError(where, f'"{command}"', f"{{{folder}}} in it")
    taken = {*CommandSettings.model_fields, *MACHINE_ONLY, "solver", "name", "folder"}  # keys of scene files
    for name in names:
        if name in taken or hasattr(CommandSettings, name):
            raise InputError(where, f'"{{{name}}}"', "another name for the setting: this one is reserved")
    return tuple(name for name in names if name not in FOLDERS)


def _check_named(key: str, names: tuple[str, ...], place: str) -> None:
    if key not in names:
        known = ", ".join(names) or "none"
        raise InputError(f"{place}.{key}", "a setting that the command does not mention", f"one of these: {known}")


@dataclass(frozen=True, kw_only=True)
class CommandSolver(MuscleSolver[CommandSettings]):
    """The solver that runs a command. Its settings are those of :class:`CommandSettings` and those that the command contains."""

    def record(self, given: Mapping[str, Any], place: str) -> type[CommandSettings]:
        """The type of the settings, with a required key for each setting in the command; a ladder marks a setting as ``Trade``."""
        command, ladder = given.get("command"), given.get("ladder", {})
        if not isinstance(command, str) or not isinstance(ladder, Mapping):
            return self.settings  # the error is reported when the settings are parsed into this record
        names = placeholders(command, place)
        for key in ladder:
            _check_named(key, names, join(place, "ladder"))
        kinds = {key: Annotated[Value, Trade(tuple(ladder[key]))] if key in ladder else Value for key in names}
        fields: dict[str, Any] = {key: (kind, ...) for key, kind in kinds.items()}
        return create_model(self.settings.__name__, __base__=self.settings, __doc__=self.settings.__doc__, **fields)

    def moved(self, settings: CommandSettings) -> Moves:
        """The mesh whose points the program moves, as stated in the settings."""
        return settings.moves

    def fills(self, settings: CommandSettings) -> bool:  # noqa: ARG002
        """True, because the exported scene always has tetrahedra and fibres."""
        return True


def require(settings: CommandSettings) -> None:
    """Raise InputError if the program or one of its ``files`` is missing."""
    _check_program(settings.command, settings.place, "command")
    sources(settings)


def _check_program(command: str, directory: Path, place: str) -> None:
    word = shlex.split(command)[0]
    if programs.found(word, directory) is None:
        raise InputError(place, f'"{word}"', f"a program in {directory}, or on the PATH, that may be executed")


def solve(problem: MuscleProblem, settings: CommandSettings, sink: Sink) -> Outcome:
    """Run the command and read the frames that it wrote. A failure is reported as a status, and earlier frames are kept. Raises
    InputError if the problem does not start at rest, or if the program does not support the scene.
    """
    if problem.start is not None:
        raise InputError("command", "a body that does not start at rest", "a body at rest, as an export begins there")
    with scratch_folder() as folder:
        places = {name: folder / name for name in FOLDERS}
        for place in places.values():
            place.mkdir()
        open_formats.write(problem, places["scene"], {})
        words = _filled(settings, places)
        try:
            ended = programs.run(words, settings.place, settings.time_limit)
        except OSError as error:
            return Outcome("crashed", f"{words[0]} does not start: {error.strerror}")
        return _read(problem, settings, ended, places["out"], sink)


def _read(problem: MuscleProblem, settings: CommandSettings, ended: programs.Ended, out: Path, sink: Sink) -> Outcome:
    """The outcome of a program that ``ended``. Its frames, up to the first missing or damaged frame, go to ``sink``. Raises
    InputError if the program does not support the scene.
    """
    if ended.code == REFUSED:
        raise InputError("command", ended.said or f"exit status {REFUSED}", "a scene that the program supports")
    free = len(problem.surface.points) - len(np.unique(problem.attached_vertices))
    unknowns = 3.0 * (free if settings.moves == "surface" else len(problem.mesh.points))
    cost = {"seconds": ended.seconds, "seconds_solve": ended.seconds, "seconds_processor": ended.processor}
    cost |= {"peak_memory_mb": ended.memory, "unknowns": unknowns}
    kept, lacks, trouble = 0, "", None
    try:
        said = recorded.checked_about(out, settings.unit)
        unit, lacks = settings.unit or length_unit(said.unit or "mm"), said.lacks
        for frame in recorded.checked_frames(problem, out, unit):
            sink(frame)
            kept += 1
        cost |= _stated(said, problem, ended)
    except InputError as error:
        trouble = error
    took = f"{ended.seconds:.3g} s, {ended.processor:.3g} s of processor time"
    last, reached = f" ({ended.said})" if ended.said else "", f"{kept} of {len(problem.frames)} frames are kept"
    if ended.limit is not None:
        status, why = ended.limit
        return Outcome(status, f"{why}{last}; {reached}", cost)
    if ended.code:
        how = f"signal {-ended.code}" if ended.code < 0 else f"exit status {ended.code}"
        program = programs.found(shlex.split(settings.command)[0], settings.place)
        return Outcome("crashed", f"{how} of {program} after {took}{last}; {reached}", cost)
    if trouble is not None:
        failed: Status = "diverged" if "not finite" in str(trouble.got) else "crashed"
        why = str(trouble).replace(f"{out}/", "").replace(str(out), "{out}")
        return Outcome(failed, f"exit status 0, but {why}; {reached}", cost)
    return Outcome("converged", f"{kept} frames in {took}{lacks}", cost)


def _stated(said: recorded.About, problem: MuscleProblem, ended: programs.Ended) -> dict[str, float]:
    """The entries of the cost that the program states: its threads, and the time in which it solved the frames. Raises InputError
    if this time exceeds the duration of the program.
    """
    found = {} if said.threads is None else {"threads": float(said.threads)}
    if said.seconds_per_frame is None:
        return found
    seconds = said.seconds_per_frame * (problem.frames[-1] - problem.frames[0])
    if seconds > ended.seconds:
        want = f"at most the {ended.seconds:.3g} s that the program took"
        raise InputError(f"{recorded.ABOUT}: seconds_per_frame", f"{seconds:.3g} s for all frames", want)
    return found | {"seconds_per_frame": said.seconds_per_frame, "seconds_solve": seconds}


_EXAMPLE = {"command": "my_solver --iterations {iterations} {scene} {out}", "iterations": 10}
SOLVES = (CommandSolver(settings=CommandSettings, solve=solve, require=require, example=_EXAMPLE),)
