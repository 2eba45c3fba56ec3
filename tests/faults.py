"""Faults of one line, planted one after the other in a copy of the project: each must turn one of the tests named red, which
passes without the fault.

``python tests/faults.py [NAME ...]`` (all without names) prints a line for each; exit status 1 where one is not noticed, or where a
test that is red with a fault is red without it (``FAILS``). With ``--places`` it plants none and says in a second which of them
have lost their place; with ``--list`` it plants none and names those that it would plant. ``faults.json`` keeps what came of each,
when and at which commit; with ``--stale`` only those are planted whose row, file or tests are not what they were then. Comments,
docstrings, layout and marks of slow tests may change without that.
"""

import argparse
import ast
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from contextlib import suppress
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from fem_reference.foundations.subprocesses import command

ROOT = Path(__file__).resolve().parent.parent
LONGEST = 3600.0  # [s] that the tests of a fault may take
_NO_END = "no end"
_MARKS = ("pytest.mark.slow", "pytest.mark.nightly")
LIST, RECORD = (Path(__file__).with_suffix(end) for end in (".toml", ".json"))


class Fault(NamedTuple):
    """In a ``file`` of the package or project ``new`` in place of ``old``, which is there once, and ``tests`` that notice it."""

    name: str
    file: str
    old: str
    new: str
    tests: str


FAULTS = [Fault(*row) for row in tomllib.loads(LIST.read_text(encoding="utf-8"))["faults"]]


def place(root: Path, fault: Fault) -> Path:
    """The file of a fault in the project below ``root``."""
    in_package = root / "fem_reference" / fault.file
    return in_package if in_package.is_file() else root / fault.file


def misplaced(fault: Fault) -> list[str]:
    """Sentences on what keeps a fault from being planted: its file, its place there, or a file of tests that is not there."""
    path = place(ROOT, fault)
    if not path.is_file():
        return [f"{fault.name}: no file {fault.file}"]
    found = path.read_text(encoding="utf-8").count(fault.old)
    places = [] if found == 1 else [f"{fault.name} ({fault.file}): {fault.old!r} is there {found} times"]
    names = [name for name in fault.tests.split() if not (ROOT / "tests" / f"{name}.py").is_file()]
    return [*places, *(f"{fault.name}: no file tests/{name}.py" for name in names)]


def fingerprint(root: Path, fault: Fault) -> str:
    """A hash of a fault and of its file and tests below ``root``, 16 hex digits."""
    files = [place(root, fault), *(root / "tests" / f"{name}.py" for name in fault.tests.split())]
    return hashlib.sha256("\n".join([repr(fault), *map(statements, files)]).encode()).hexdigest()[:16]


def statements(path: Path) -> str:
    """The statements of a Python file, without comments, docstrings, layout and marks of slow tests; the text of any other file."""
    text = path.read_text(encoding="utf-8")
    return _statements(text) if path.suffix == ".py" else text


@cache
def _statements(text: str) -> str:
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node) is not None:
            del node.body[0]
        if isinstance(node, ast.FunctionDef):
            node.decorator_list = [one for one in node.decorator_list if ast.unparse(one) not in _MARKS]
    return ast.unparse(tree)


def key(fault: Fault) -> str:
    """What a fault is called in the record and in what is printed."""
    return f"{fault.name} ({fault.file})"


def recorded() -> dict[str, dict[str, Any]]:
    """What came of faults, by name and file."""
    return json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.is_file() else {}


def record(fault: Fault, text: str, *, red: bool) -> None:
    """Keep what came of a fault with the fingerprint ``text``."""
    commit = subprocess.run(
        ["git", "rev-parse", "--short=8", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    now = {"red": red, "date": f"{datetime.now(UTC):%Y-%m-%d}", "commit": commit.stdout.strip(), "text": text}
    rows = sorted((recorded() | {key(fault): now}).items())
    lines = ",\n".join(f"{json.dumps(name)}: {json.dumps(row)}" for name, row in rows)
    RECORD.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")


def plant(fault: Fault, copy: Path) -> tuple[str, str]:
    """What came of a fault that is in ``copy`` while its tests run there: "red" with the test that noticed it, "GREEN" with what
    was said, or "FAILS" with a test that is red without the fault too. The quick tests come first.
    """
    path, files = place(copy, fault), [f"tests/{name}.py" for name in fault.tests.split()]
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace(fault.old, fault.new), encoding="utf-8")
    try:
        for marker in ("not slow", "slow"):
            failed, said = failing(copy, "-m", marker, *files)
            if failed:
                break
    finally:
        path.write_text(text, encoding="utf-8")
    if not failed:
        return "GREEN", said
    return "FAILS" if failing(copy, failed)[0] else "red", failed


def failing(copy: Path, *chosen: str) -> tuple[str, str]:
    """The first of the ``chosen`` tests in ``copy`` that fails, empty where all pass, ``_NO_END`` where they do not get so far; and
    the last line that was printed. No process that they start goes on after them.
    """
    words = ["-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "--no-header", *chosen]
    settings = {"PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1", "OMP_NUM_THREADS": "1"}
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as said:
        streams = {"stdout": said, "stderr": said}  # no pipe: what goes on would keep it open
        tests = subprocess.Popen(
            command(*words), cwd=copy, env=os.environ | settings, start_new_session=True, **streams
        )
        try:
            tests.wait(LONGEST)
        except subprocess.TimeoutExpired:
            said.write(f"no end after {LONGEST:g} s\n")
        finally:
            with suppress(ProcessLookupError):
                os.killpg(tests.pid, signal.SIGKILL)
            tests.wait()
        said.seek(0)
        lines = said.read().strip().splitlines() or ["nothing said"]
    found = [match[1] for line in lines if (match := re.match(r"(?:FAILED|ERROR) (.+?)(?: - |$)", line))]
    passed = tests.returncode in (0, 5)  # 5: none of this marker
    return "" if passed else (found or [_NO_END])[0], lines[-1]


def main() -> int:
    """Plant the faults; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="a part of a name or of a file (default: all faults)")
    parser.add_argument("--places", action="store_true", help="plant none: look only for the places of the faults")
    parser.add_argument("--list", action="store_true", help="plant none: name those that would be planted")
    parser.add_argument("--stale", action="store_true", help="only faults that were not planted in the texts of now")
    given = parser.parse_args()
    names = given.names
    chosen = [one for one in FAULTS if not names or any(name in one.name or name in one.file for name in names)]
    twice = Counter(fault[1:4] for fault in chosen)
    lost = [f"{old!r} in {file} is listed {count} times" for (file, old, _), count in twice.items() if count > 1]
    lost += [f"{name} is the name of {count}" for name, count in Counter(map(key, chosen)).items() if count > 1]
    lost += [sentence for fault in chosen for sentence in misplaced(fault)]
    sys.stdout.writelines(f"LOST  {sentence}\n" for sentence in lost)
    if lost or given.places:
        return 1 if lost else 0
    if given.stale:
        chosen = [one for one in chosen if recorded().get(key(one), {}).get("text") != fingerprint(ROOT, one)]
    if given.list:
        sys.stdout.writelines(f"{key(one)}: {one.tests}\n" for one in chosen)
        return 0
    return planted(chosen)


def planted(chosen: list[Fault]) -> int:
    """Plant the faults and keep what comes of them; the exit status."""
    counts = Counter[str]()
    with tempfile.TemporaryDirectory(prefix="faults-") as folder:
        copy = Path(folder) / "copy"
        ignored = shutil.ignore_patterns(".git", ".venv", "*.pyc.*", "reports")
        shutil.copytree(ROOT, copy, ignore=ignored)
        for fault in chosen:
            begin, text = time.perf_counter(), fingerprint(copy, fault)
            result, said = plant(fault, copy)
            counts[result] += 1
            if result != "FAILS":
                record(fault, text, red=result == "red")
            sys.stdout.write(f"{result:5} {key(fault)}: {said}, {time.perf_counter() - begin:.0f} s\n")
            sys.stdout.flush()
    sys.stdout.write(
        f"{len(chosen)} faults, {counts['GREEN']} not noticed, {counts['FAILS']} with tests that fail anyway\n"
    )
    return 0 if counts["red"] == len(chosen) else 1


if __name__ == "__main__":
    sys.exit(main())
