"""Counts of the house: its size, arrows against the order of packages, loose types, twins of names, tests that are not there.

``python tests/counts.py`` prints each count beside what is allowed and exits with 1 where one is above; with ``--where`` it lists
each place.
"""

import ast
import collections
import functools
import itertools
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "fem_reference"
# A package imports only what stands before it (or in itself).
ORDER = [
    "foundations",
    "io",
    "effects",
    "geometry",
    "scenes",
    "problems",
    "runs",
    "solvers",
    "metrics",
    "assessment",
    "export",
    "report",
    "studies",
    "verification",
    "cli",
]
KINDS = {"MuscleCase", "ScalarCase", "Problem", "Setup", "FieldProblem", "Body", "Solved"}
HEADLESS = {
    "What",
    "How",
    "Whether",
    "Where",
    "When",
    "Who",
    "Why",
    "Which",
    "By",
    "Of",
    "As",
    "That",
    "From",
    "With",
    "To",
}


class Module(NamedTuple):
    """A file of the package: its ``name`` below it, its ``lines``, those of ``code`` and its ``tree``."""

    name: str
    lines: int
    code: int
    tree: ast.Module


@functools.cache
def modules() -> list[Module]:
    """Every file of the package, parsed once."""
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(PACKAGE.rglob("*.py"))}
    return [Module(str(path.relative_to(PACKAGE)), *sizes(text), ast.parse(text)) for path, text in texts.items()]


def sizes(text: str) -> tuple[int, int]:
    """The number of lines of a source ``text``, and of those that are neither blank nor of a comment or a docstring."""
    lines = text.splitlines()
    words = {i for i, line in enumerate(lines, 1) if not line.strip() or line.lstrip().startswith("#")}
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node) is not None:
            words |= set(range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1))
    return len(lines), len(lines) - len(words)


def imported(tree: ast.AST) -> set[str]:
    """Every module that is imported, anywhere in ``tree``."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module == "fem_reference":
            found |= {f"fem_reference.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module or "")
    return found


def arrows_up(house: list[Module]) -> Iterator[str]:
    """Imports against the order of packages; from the package itself, too, which stands above them all."""
    for module in house:
        room = module.name.split("/")[0]
        if room not in ORDER:
            continue
        later = {f"fem_reference.{name}" for name in [*ORDER[ORDER.index(room) + 1 :], "__version__"]}
        for name in imported(module.tree):
            if ".".join(name.split(".")[:2]) in later or name == "fem_reference":
                yield f"{module.name} imports {name}"


def loose_types(house: list[Module]) -> Iterator[str]:
    """Public functions of ``problems``, ``runs`` and ``studies/execution`` whose signature has ``Any``, and public calls."""
    for module in house:
        if not (module.name.startswith(("problems/", "runs/", "studies/")) or module.name == "__init__.py"):
            continue
        for node in ast.walk(module.tree):
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                hints = [arg.annotation for arg in (*node.args.args, *node.args.kwonlyargs)] + [node.returns]
                if any(re.search(r"\bAny\b", ast.unparse(hint)) for hint in hints if hint is not None):
                    yield f"{module.name}:{node.lineno} {node.name}"


def questions_of_kind(house: list[Module]) -> Iterator[str]:
    """``isinstance`` on the kind of problem outside ``scenes`` and ``problems``, and functions that choose by the type of it."""
    for module in house:
        if module.name.startswith(("scenes/", "problems/")):
            continue
        for node in ast.walk(module.tree):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "isinstance":
                asked = {name.id for name in ast.walk(node.args[1]) if isinstance(name, ast.Name)}
                if asked & KINDS:
                    yield f"{module.name}:{node.lineno} {ast.unparse(node)}"
            elif isinstance(node, ast.FunctionDef):
                for mark in node.decorator_list:
                    if "singledispatch" in ast.unparse(mark):
                        yield f"{module.name}:{node.lineno} singledispatch {node.name}"


def long_files(house: list[Module]) -> Iterator[str]:
    """Files of more than 300 lines."""
    return (f"{module.name} {module.lines}" for module in house if module.lines > 300)


def long_functions(house: list[Module]) -> Iterator[str]:
    """Functions of more than 40 lines."""
    for module in house:
        for node in ast.walk(module.tree):
            if isinstance(node, ast.FunctionDef) and (length := (node.end_lineno or 0) - node.lineno + 1) > 40:
                yield f"{module.name}:{node.lineno} {node.name} {length}"


def twins_of_classes(house: list[Module]) -> Iterator[str]:
    """Public names that stand for more than one class."""
    places = collections.defaultdict(list)
    for module in house:
        for node in module.tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(module.name)
    return (f"{name}: {', '.join(found)}" for name, found in places.items() if len(found) > 1)


def headless_docstrings(house: list[Module]) -> Iterator[str]:
    """Docstrings that begin with neither a verb nor a noun."""
    for module in house:
        for node in ast.walk(module.tree):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                text = ast.get_docstring(node) or ""
                if re.split(r"\W", text, maxsplit=1)[0] in HEADLESS:
                    yield f"{module.name}:{getattr(node, 'lineno', 1)} {text.splitlines()[0][:80]}"


def untested_modules(house: list[Module]) -> Iterator[str]:
    """Modules without a file of tests of their own: that of ``a/b.py`` is ``tests/a/test_b.py``, of a package ``test_init.py``.

    What lies in a folder where each file is an entry of one kind is asked by the contract of that kind.
    """
    by_contract = ("effects/", "metrics/", "io/formats/", "report/sections/", "verification/", "cli/")
    for module in house:
        if module.lines < 12 or module.name.startswith(by_contract):
            continue
        folder, _, file = module.name.rpartition("/")
        if not (ROOT / "tests" / folder / f"test_{file.replace('__init__', 'init')}").is_file():
            yield module.name


class Count(NamedTuple):
    """A count with how many are allowed."""

    title: str
    places: Callable[[list[Module]], Iterator[str]]
    most: int


COUNTS = (
    Count("arrows up", arrows_up, 0),
    Count("Any in public signatures", loose_types, 0),
    Count("questions of the kind of problem", questions_of_kind, 0),
    Count("files above 300 lines", long_files, 0),
    Count("functions above 40 lines", long_functions, 0),
    Count("names of two classes", twins_of_classes, 0),
    Count("headless docstrings", headless_docstrings, 0),
    Count("modules without a file of tests", untested_modules, 0),
)
# Lines of the library: as many without the capabilities that came later, each with what it added.
LINES = 36_000
ADDED = {
    "a second check of every run, by code of its own, and its negative controls": 660,
    "forces and moment arms, Hill's muscle, decompositions into fibres, estimation, rbf_muscle, viper": 3550,
    "experiments, credibility, tension at rest, unknown parameters, calibration": 3940,
    "fibres by area, their ends on bones": 490,
    "regions, membranes, tendons that pull": 880,
    "contact between parts of the surface": 740,
    "contact along the points' own normals, an option": 320,
    "several muscles in one scene": 1200,
    "exports of several muscles, the depth of muscles in each other": 250,
    "friction": 690,
    "contact of a part with itself": 220,
    "own solvers as commands, load of the machine, answers first": 880,
    "laws of other people's solvers, split errors, standings": 700,
    "a data set to learn from": 460,
    "a muscle's body beside its measurement, an indentation": 190,
    "time limits in standings, hard cases by programs of other people, laws that cannot be split": 110,
    "anatomy out of downloads": 110,
    "error bars of several muscles": 200,
    "error bars that a case cannot have, refused before anything is solved": 30,
    "one of several muscles, compared from Python": 40,
    "a check of one of several muscles": 30,
    "the second check of curved facets of several muscles": 40,
    "contact on attached areas": 20,
    "hard cases of several bodies, paths of pressed points": 170,
    "regions in the export to FEBio, the law corotated": 140,
    "error bars from two runs at a time, on tetrahedra that can be set up": 110,
    "lines that end at facets out of reach": 15,
    "docstrings that say in sentences what each argument and result is": 1460,
    "distinct rows as sorted integers, keys of stored meshes with all code, a loader that counts": 96,
}
# The same limit for lines of code: those that are neither blank nor part of a comment or a docstring.
CODE = 36_000


def main(words: list[str]) -> int:
    """Print the counts; the exit status."""
    house = modules()
    total = sum(module.lines for module in house)
    most = LINES + sum(ADDED.values())
    code = sum(module.code for module in house)
    sys.stdout.write(f"{total:6} of at most {most}: lines of the library\n")
    sys.stdout.write(f"{code:6} of at most {CODE}: lines of code\n")
    over = total > most or code > CODE
    for count in COUNTS:
        places = list(count.places(house))
        over |= len(places) > count.most
        sys.stdout.write(f"{len(places):6} of at most {count.most}: {count.title}\n")
        if "--where" in words:
            sys.stdout.writelines(f"         {place}\n" for place in places)
    if "--where" in words:
        sizes = itertools.groupby(house, lambda module: module.name.split("/")[0])
        sys.stdout.writelines(f"{sum(one.lines for one in group):6} {room}\n" for room, group in sizes)
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
