"""The verb ``completion``: a script that lets a shell complete verbs, options and names, made by shtab from the command line."""

import argparse

import shtab

from fem_reference import solvers
from fem_reference.cli import DONE, _parser, write_output
from fem_reference.scenes import casefile

HELP = "print a script with which a shell completes verbs, options and names of cases"
_COMPLETE = "complete"  # the attribute of an action that shtab looks for
# Commands that complete as ``fem-reference`` does, by the name that shtab gives its function.
_ALIASES = {
    "bash": "complete -o default -F _shtab_fem_reference fem-reference fem ./fem\n",
    "fish": "complete -c fem -w fem-reference\n",
    "zsh": "compdef _shtab_fem_reference fem\n",
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Option for the shell; it writes nothing into ``--out``."""
    shells = sorted(_ALIASES)
    parser.add_argument("shell", metavar="SHELL", choices=shells, help=f"one of {', '.join(shells)}")
    parser.set_defaults(writes=False)


def run(options: argparse.Namespace) -> int:
    """Print the script, made from the present command line."""
    text = script(options.shell)
    write_output({"shell": options.shell, "script": text}, text.rstrip(), options)
    return DONE


def script(shell: str) -> str:
    """The script for a ``shell``, which completes verbs, options, names of cases and solvers, files and folders."""
    whole = _parser.parser()
    (kinds,) = (one for one in whole._actions if isinstance(one, argparse._SubParsersAction))
    for action in (action for verb in kinds.choices.values() for action in verb._actions):
        if action.choices is None and action.dest in ("case", "cases"):
            action.choices = casefile.cases()
        elif action.choices is None and action.metavar == "NAME" and action.dest == "solver":
            action.choices = solvers.names()
        elif str(action.metavar).endswith("FILE"):
            setattr(action, _COMPLETE, shtab.FILE)
        elif str(action.metavar).endswith("DIR"):
            setattr(action, _COMPLETE, shtab.DIRECTORY)
    return f"{shtab.complete(whole, shell)}\n{_ALIASES[shell]}"
