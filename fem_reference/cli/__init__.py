"""The command line: the only part of the package that prints, shows progress and exits."""

import argparse
import json
import logging
import os
import re
import sys
import traceback
from pathlib import Path
from typing import Any

from fem_reference.cli._explained import page_of
from fem_reference.cli._parser import parser
from fem_reference.foundations import signals
from fem_reference.foundations.errors import InputError, MissingSoftware

DONE, VERDICT_FAIL, BAD_INPUT, SOLVER_FAILED = range(4)
# The status for an error in this program: EX_SOFTWARE of sysexits.h. Python exits with 1 after an exception; here 1 is a verdict.
BROKEN = 70
INTERRUPTED = 130  # the status that shells report after an interrupt
TRACEBACK_SETTING = "FEM_REFERENCE_TRACEBACK"
_CHECKOUT = Path(__file__).resolve().parents[2]  # the checkout, or the folder in which the package is installed


def entry() -> None:
    """Run the installed command."""
    signals.listen()
    # Numpy reads this variable when it is loaded. On a busy machine, more threads would wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    sys.exit(main(sys.argv[1:]))


def main(arguments: list[str]) -> int:
    """Carry out a command line, and return the exit status."""
    options, log = argparse.Namespace(quiet=False), logging.getLogger("fem_reference")  # only our own messages
    level, handlers = log.level, log.handlers[:]
    try:
        words = [word for word in arguments if not word.startswith("-")]
        options = parser(words[0] if words else "").parse_args(arguments)
        log.setLevel(logging.WARNING if options.quiet else logging.INFO)
        log.handlers[:] = [logging.StreamHandler(sys.stderr)]
        _check_outputs(options)
        _check_name(options.page_name)
        status: int = options.verb(options)
    except (InputError, OSError, MissingSoftware) as error:
        print(f"fem-reference: {error}", file=sys.stderr)
        _explain(str(error).partition("\n")[0], options)
        return SOLVER_FAILED if isinstance(error, MissingSoftware) else BAD_INPUT
    except KeyboardInterrupt:
        said = "interrupted; stored results are kept, and a run of the reference continues next time"
        print(f"fem-reference: {said}", file=sys.stderr)
        return INTERRUPTED
    except SystemExit:
        raise
    except BaseException as error:  # no error may end with the status of a verdict
        print(f"fem-reference: {_why_broken(error)}", file=sys.stderr)
        return BROKEN
    finally:
        log.setLevel(level)
        log.handlers[:] = handlers
    return status


def _explain(message: str, options: argparse.Namespace) -> None:
    """Print the path of the documentation page that explains a message, if the page exists; only a checkout has these pages."""
    found = page_of(message)
    if found and not options.quiet and (_CHECKOUT / found.partition("#")[0]).exists():
        print(f"see {found}", file=sys.stderr)


def _why_broken(error: BaseException) -> str:
    """The message for an unexpected exception: the text of the exception, its place in the code, and a remedy."""
    if isinstance(error, MemoryError):
        return "not enough memory; nothing was judged. Smaller input or larger tetrahedra need less memory"
    if isinstance(error, ModuleNotFoundError) and not (error.name or "").startswith("fem_reference"):
        return (
            f"the Python package {error.name} is not installed for {sys.executable}: use its pip to install fem_reference with "
            "all packages that it needs"
        )
    frames = traceback.extract_tb(error.__traceback__)
    places = [f"{Path(frame.filename).name}:{frame.lineno}" for frame in frames[-3:]]
    what = " ".join(f"{type(error).__name__}: {error}".split())[:300]
    if os.environ.get(TRACEBACK_SETTING):
        traceback.print_exception(error)
    return (
        f"an error in fem-reference itself, not a verdict: {what} ({' < '.join(reversed(places))}). Please report it to whoever "
        f"gave you fem-reference, with the command line; {TRACEBACK_SETTING}=1 shows the full traceback"
    )


def _check_outputs(options: argparse.Namespace) -> None:
    """Raise InputError if an output cannot be written. The check comes before any measurement, and creates nothing."""
    _check_folder("--out", out(options), written=options.writes)
    if getattr(options, "to", None) is not None:
        _check_folder("--to", options.to.absolute().parent, written=True)
    written = ["json", "junit", "markdown", *(["baseline"] if getattr(options, "update", False) else [])]
    for name in written:
        path = getattr(options, name, None)
        if path is not None and path.is_dir():
            raise InputError(f"--{name}", f'"{path}", a folder', "a file")
        if path is not None and not path.exists():
            _check_folder(f"--{name}", path.parent, written=True)


def _check_name(name: str | None) -> None:
    """Raise InputError if ``--name`` cannot be the name of a page: the names of other files next to pages are reserved."""
    from fem_reference.report.asked import LONGEST  # imported here, because packages that it needs may be missing

    taken = ("runs", "docs", "index")
    if name is not None and (name in taken or not re.fullmatch(rf"\w[\w.=+-]{{0,{LONGEST - 1}}}", name)):
        want = f"at most {LONGEST} letters, digits and . _ = + -, and not runs, docs or index"
        raise InputError("--name", f'"{name}"', want)


def _check_folder(place: str, folder: Path, *, written: bool) -> None:
    """Raise InputError at ``place`` unless ``folder`` exists or can be made, and is writable if it is to be ``written``."""
    there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not there.is_dir():
        raise InputError(place, f'"{folder}", where "{there}" is a file', "a folder")
    if written and not os.access(there, os.W_OK | os.X_OK):
        raise InputError(place, f'"{folder}", where "{there}" is not writable', "a folder with permission to write")


def out(options: argparse.Namespace) -> Path:
    """The folder of pages and stored runs."""
    return options.out if options.out is not None else Path("reports")


def write_output(facts: dict[str, Any], text: str, options: argparse.Namespace) -> None:
    """Print ``text``; with ``--json`` also write ``facts`` as JSON."""
    print(text)
    _explain(text, options)
    if options.json is not None:
        write(options.json, json.dumps(facts, indent=1, allow_nan=False))


def write(path: Path | None, text: str) -> None:
    """Write ``text`` to ``path``, if a path is given; create its folder if necessary."""
    if path is not None:
        from fem_reference.io import files

        path.parent.mkdir(parents=True, exist_ok=True)
        files.write_text(path, text)
