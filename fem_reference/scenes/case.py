"""The keys and methods that all cases share; muscle cases and scalar cases add further keys.

``Case.key`` is a hash of everything that determines the solution of a case, including the contents of its files.
"""

import hashlib
import json
import os
import re
import sys
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

from pydantic import ConfigDict, Field

from fem_reference.foundations import outside
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.markup import fact_table
from fem_reference.foundations.records import FileName, Name, Record, join

DATA_SETTING = "FEM_REFERENCE_DATA"
# The environment variable that lists, separated as in PATH, further folders from which scene files may read files.
ALLOWED_SETTING = "FEM_REFERENCE_FILES"
COMMAND = "command"  # the solver that runs a program; a scene file cannot choose this solver
DELAUNAY = "delaunay"  # the word that stands in place of the name of a file of triangles
# Solver settings that affect the computing time but not the results.
MACHINE_ONLY = frozenset({"ranks", "time_limit", "linear_solver", "precision", "store_state"})

# The standards against which a run is measured: the reference (for the reference itself, its rest state), the exact solution, or
# the run itself.
Standard = Literal["reference", "exact", "itself"]
# Parts of a run that can be measured.
Part = Literal["surface", "lines", "field"]


def home(package: Path) -> Path:
    """The folder with ``cases`` and ``meshes``: the package itself if it is installed, or its parent folder in a checkout."""
    return package if (package / "cases").is_dir() else package.parent


HOME = home(Path(__file__).resolve().parent.parent)


class SolverChoice(Record):
    """The name of a ``solver``. All further keys are settings of this solver, which checks them."""

    model_config = ConfigDict(frozen=True, extra="allow")
    solver: str

    @property
    def settings(self) -> dict[str, Any]:
        """Every key except ``solver`` and, in a candidate, ``name``."""
        return dict(self.model_extra or {})


class Candidate(SolverChoice):
    """A candidate: a ``solver`` whose results are compared with the reference under a ``name``. All further keys are settings of
    the solver.
    """

    name: FileName


class Expectation(Record):
    """A condition on a run: a measure must differ from its ``truth`` by at most ``within``.

    ``of``: ``"reference"``, the name of a candidate, or ``"candidates"`` for all compared candidates. ``statistic``: optional if
    the metric has only one. ``frame``: a frame number, or ``"any"`` for every frame. ``truth`` and ``within``: text with a unit, or
    numbers if the metric has no unit. ``kind``: the source of the truth. ``because``: the reason for the expectation.
    """

    of: str
    metric: str
    statistic: str | None = None
    frame: int | Literal["any"] = "any"
    truth: str | float
    within: str | float
    kind: Literal["closed form", "manufactured", "published", "property", "reference run", "pinned"]
    because: str


class NegativeControl(Record):
    """One change to this case that must turn its verdict into fail: the ``key`` to change, its new ``value``, and the reason."""

    key: str
    value: str | int | float
    because: str


class Case(Record):
    """A case that was read and checked.

    ``quick``: new values by key, for a faster and less accurate solution, as in tests. ``unsolved``: the reason, if the reference
    does not reach the last frame. Some fields are not keys of the case file: the ``name`` of the case; its ``folder``; ``place``,
    the name of its file in messages; ``from_file``, True if it was read from a file; and, with ``effects = "auto"``, the
    ``decisions``: for each effect in the file, whether the case needs it and why.
    """

    title: str
    proves: str
    effect: tuple[Any, ...] = Field(min_length=1)
    reference: SolverChoice
    candidate: tuple[Candidate, ...] = ()
    expect: tuple[Expectation, ...] = ()
    negative_control: NegativeControl | None = None
    quick: dict[str, Any] = Field(default_factory=dict)
    unsolved: str = ""
    name: Name = Field(exclude=True)
    folder: Path = Field(exclude=True)
    place: str = Field(default="case", exclude=True)
    from_file: bool = Field(default=False, exclude=True)
    decisions: tuple[Any, ...] = Field(default=(), exclude=True)

    # The task of the solvers, the parts that a run consists of, the keys that determine the solution, and the keys that name files.
    task: ClassVar[Literal["solve", "solve_field"]]
    carries: ClassVar[frozenset[Part]]
    determined_by: ClassVar[frozenset[str]]
    naming_files: ClassVar[frozenset[str]]

    @property
    def effects(self) -> tuple[Any, ...]:
        """The effects, in the order of the file."""
        return self.effect

    @property
    def parts(self) -> "tuple[Case, ...]":
        """The muscles of a case of several muscles, each as a separate case; none for any other case."""
        return ()

    def expecting(self, more: tuple[Expectation, ...]) -> Self:
        """A copy of the case to which the expectations ``more`` are added."""
        return self.model_copy(update={"expect": (*self.expect, *more)})

    @property
    def acting(self) -> dict[str, Any]:
        """The effects by title, which is unique within the case."""
        return {getattr(effect, "title", type(effect).__name__): effect for effect in self.effects}

    @property
    def numbers(self) -> tuple[int, ...]:
        """The requested frame numbers."""
        raise NotImplementedError(f"{type(self).__name__} has no frames")

    def standards(self, of: str) -> frozenset[Standard]:  # noqa: ARG002
        """The standards against which a run is measured. ``of``: the name of a candidate, or ``"reference"``."""
        return frozenset({"reference", "itself"})

    @property
    def facts(self) -> dict[str, str]:
        """A summary of the case in words, by heading."""
        raise NotImplementedError(f"{type(self).__name__} has no facts")

    def _repr_html_(self) -> str:
        facts = self.facts | {
            "effects": ", ".join(self.acting),
            "reference": self.reference.solver,
            "candidates": ", ".join(candidate.name for candidate in self.candidate) or "none",
        }
        return fact_table(f"{self.name}: {self.title}", facts)

    @property
    def needed_data(self) -> list[str]:
        """The files in the data folder (``data:``) that determine the solution."""
        known = json.dumps(self.model_dump(mode="json", include=set(self.determined_by)))
        return sorted(set(re.findall(r'"data:([^"]+)"', known)))

    def file(self, text: str, key: str) -> Path:
        """The path of the file that the ``text`` of a ``key`` names.

        A name that begins with ``data:`` is relative to the data folder, a name that begins with ``mesh:`` to the shipped meshes,
        and any other name to the folder of the case. Raises InputError if the file does not exist or may not be read.
        """
        place = join(self.place, key)
        if text.startswith("data:"):
            root = os.environ.get(DATA_SETTING)
            if not root:
                got = f'"{text}" while {DATA_SETTING} is not set'
                raise InputError(place, got, f"the setting {DATA_SETTING}=FOLDER")
            path = Path(root) / text.removeprefix("data:")
        elif text.startswith("mesh:"):
            path = HOME / "meshes" / text.removeprefix("mesh:")
        else:
            path = self.folder / text
        if not _exists(path):
            raise InputError(place, f'"{text}", which is not at {path}', "a file that exists")
        self._check_allowed(path, place, text)
        return path

    def _check_allowed(self, path: Path, place: str, text: str) -> None:
        """Raise InputError if a scene file names a file that is outside the folders it may read, once links are resolved."""
        if not self.from_file:
            return
        settings = os.pathsep.join(os.environ.get(name, "") for name in (DATA_SETTING, ALLOWED_SETTING))
        folders = [self.folder, HOME / "meshes", *map(Path, filter(None, settings.split(os.pathsep)))]
        if not any(path.resolve().is_relative_to(folder.resolve()) for folder in folders):
            want = f"a file in the folder of the scene, or {ALLOWED_SETTING}=FOLDER for another folder"
            raise InputError(place, f'"{text}", which is at {path.resolve()}', want)

    def check_solvers(self) -> None:
        """Raise InputError if a scene file chooses the solver ``command``, which runs a program."""
        candidates = ((f"candidate[{i}]", one) for i, one in enumerate(self.candidate))
        for key, one in (("reference", self.reference), *candidates):
            if self.from_file and one.solver == COMMAND:
                want = "another solver: a scene file cannot run a program; --solver-command can"
                raise InputError(join(self.place, f"{key}.solver"), f'"{COMMAND}"', want)

    @property
    def decides(self) -> list[Any]:
        """Everything that affects verdicts: the keys that determine the solution, the effects, and the name and the settings of
        each judged solver, without settings that do not affect results.
        """
        judged = {entry.of for entry in self.expect}
        others = [one for one in self.candidate if judged & {one.name, "candidates"}]
        solved = [
            (one.solver, {key: value for key, value in one.settings.items() if key not in MACHINE_ONLY})
            for one in (self.reference, *others)
        ]
        return [self.model_dump(include={*self.determined_by, "choice"}), self.effects, solved]

    def determining(self) -> dict[str, Any]:
        """The keys that determine the solution, with their values but without the effects."""
        return self.model_dump(mode="json", include=set(self.determined_by))

    @property
    def key(self) -> str:
        """A hash of everything that determines the solution: the keys in ``determined_by``, the effects, the contents of the files
        that they name, and the source files of effects that are defined outside the package.
        """
        tables = self.determining()
        tables["effect"] = [[type(effect).__name__, effect.model_dump(mode="json")] for effect in self.effects]
        digest = hashlib.sha256(json.dumps(_unnamed(tables, self.naming_files), sort_keys=True).encode())
        for key, text in _files(tables, self.naming_files):
            digest.update(self.file(text, key).read_bytes())
        for effect in self.effects:
            digest.update(outside.source(sys.modules[type(effect).__module__]))
        return digest.hexdigest()


def _exists(path: Path) -> bool:
    """True if the file or folder exists; False if it does not, or if its name cannot be a path."""
    try:
        return path.exists()
    except (OSError, ValueError):  # a name that is too long or contains a null character
        return False


def _unnamed(tables: Any, names: Collection[str]) -> Any:
    """A copy of ``tables`` with each file name reduced to its suffix, which determines how the file is read. ``names``: the keys
    whose values are file names.
    """
    if isinstance(tables, dict):
        files = {name for name, text in tables.items() if name in names and isinstance(text, str) and text != DELAUNAY}
        return {name: Path(value).suffix if name in files else _unnamed(value, names) for name, value in tables.items()}
    return [_unnamed(value, names) for value in tables] if isinstance(tables, list) else tables


def _files(tables: Any, names: Collection[str], key: str = "") -> Iterator[tuple[str, str]]:
    """The key and the name of each file in ``tables``. ``names``: the keys of file names; ``key``: the key of ``tables`` itself."""
    if isinstance(tables, list):
        for i, value in enumerate(tables):
            yield from _files(value, names, f"{key}[{i}]")
    for name, value in tables.items() if isinstance(tables, dict) else ():
        where = f"{key}.{name}".lstrip(".")
        if name in names and isinstance(value, str) and value != DELAUNAY:
            yield where, value
        yield from _files(value, names, where)
