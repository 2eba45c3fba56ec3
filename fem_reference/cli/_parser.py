"""The parser of the command line: every module in this folder whose name begins with a letter is a verb.

A verb has ``HELP``, ``add_options(parser)``, and ``run(options)``, which prints the results and returns the exit status.
"""

import argparse
import ast
import importlib
from pathlib import Path
from types import ModuleType
from typing import Any

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.version import __version__

_FOLDER = Path(__file__).parent
CASE = "a shipped case (see list), a case folder or a case.toml"


def positive(text: str) -> int:
    """An integer from 1 to 999999999.

    >>> positive("2")
    2
    """
    if not text.isdecimal() or not 0 < len(text.lstrip("0")) < 10:
        raise argparse.ArgumentTypeError(f'got "{text[:20]}", want a number from 1 to 999999999')
    return int(text)


# The options that several verbs share.
_SHARED: dict[str, dict[str, Any]] = {
    "case": {"metavar": "CASE", "help": CASE},
    "--set": {
        "action": "append",
        "default": [],
        "metavar": "KEY=VALUE",
        "help": "change a key of the case, such as muscle.tet_size='8 mm'; may be repeated",
    },
    "--unit": {"help": "unit of length of the frames in DIR (default: the unit in its candidate.toml, else mm)"},
    "--solver-command": {
        "metavar": "COMMAND",
        "help": "your own solver as a candidate: a command with {scene} and {out}, and settings in braces that a "
        "candidate.toml describes",
    },
    "--error-bar": {
        "action": "store_true",
        "help": "compute error bars of the reference: also solve it on larger tetrahedra and, if there is contact, with stiffer "
        "contact",
    },
    "--negative-control": {
        "action": "store_true",
        "help": "apply the case's negative control, a change that must turn its verdict to fail",
    },
    "--name": {
        "dest": "page_name",
        "metavar": "NAME",
        "help": "name of the page (default: the case with its changes, such as CASE-KEY=VALUE)",
    },
    "--ranks": {
        "type": positive,
        "metavar": "N",
        "help": "MPI processes of the reference (default: 1, or 2 for large bodies if cores are free)",
    },
    "--workers": {"type": int, "default": 1, "metavar": "N", "help": "number of simultaneous runs (default: 1)"},
    "--scheduler": {
        "metavar": "ADDRESS",
        "help": "address of a Dask scheduler (for example of dask-jobqueue) whose workers do the runs; they need access to --out",
    },
}


def share(parser: argparse.ArgumentParser, *names: str) -> None:
    """Add options that several verbs share, by name."""
    for name in names:
        parser.add_argument(name, **_SHARED[name])


def names() -> list[str]:
    """The names of all verbs."""
    return sorted(path.stem.replace("_", "-") for path in _FOLDER.glob("*.py") if not path.stem.startswith("_"))


def verb(name: str) -> ModuleType:
    """The module of a verb."""
    return importlib.import_module(f"{__package__}.{name.replace('-', '_')}")


def parser(only: str | None = None) -> argparse.ArgumentParser:
    """The parser of the command line; with ``only``, it has the options of this verb alone: importing all verbs takes seconds."""
    about = "Finite element reference and validation for muscle deformation."
    whole = argparse.ArgumentParser(prog="fem-reference", description=about)
    whole.add_argument("--version", action="version", version=f"fem-reference {__version__}")
    kinds = whole.add_subparsers(metavar="VERB", required=True)
    for name in names():
        # The purpose of a verb is read from a single line of its file, as importing or parsing the file takes a long time.
        lines = (_FOLDER / f"{name.replace('-', '_')}.py").read_text(encoding="utf-8").splitlines()
        text = next(ast.literal_eval(line.removeprefix("HELP = ")) for line in lines if line.startswith("HELP = "))
        sub = kinds.add_parser(name, help=text, description=text)
        if only in (None, name):
            _add(verb(name), sub)
    return whole


def _add(verb: ModuleType, sub: argparse.ArgumentParser) -> None:
    """Add the options of a verb, and the options of all verbs."""
    sub.register("action", None, _Given)
    sub.set_defaults(verb=verb.run, ranks=None, error_bar=False, negative_control=False)
    sub.set_defaults(limit=[], writes=True, page_name=None)
    verb.add_options(sub)
    sub.add_argument("--out", type=Path, metavar="DIR", help="folder for pages and stored runs (default: reports)")
    sub.add_argument("--json", type=Path, metavar="FILE", help="write the printed results as JSON")
    sub.add_argument("--quiet", action="store_true", help="show no progress")


class _Given(argparse.Action):
    """The action of all options: an option may be given only once, as a second value would replace the first. An option with a list
    may be repeated, and repeated values are dropped.
    """

    def __call__(self, parser: Any, namespace: Any, values: Any, option_string: str | None = None) -> None:
        del parser
        if option_string and isinstance(self.default, list):
            values = list(dict.fromkeys([*getattr(namespace, self.dest), values]))
        else:
            given = namespace.__dict__.setdefault("given", {})
            if option_string and self.dest in given:
                raise InputError(option_string, f'"{given[self.dest]}" and "{values}"', "one of them")
            given[self.dest] = values
        setattr(namespace, self.dest, values)
