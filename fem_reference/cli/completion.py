"""The verb ``completion``: a script that lets a shell complete verbs, options and names."""

import argparse
import shlex
from collections.abc import Iterator
from dataclasses import dataclass

from fem_reference import solvers
from fem_reference.cli import _parser
from fem_reference.cli._printing import DONE, write_output
from fem_reference.scenes import casefile

HELP = "print what lets a shell complete verbs, options and names of cases"
COMMANDS = ("fem-reference", "fem")
_PATHS = ("DIR", "FILE")


@dataclass(frozen=True)
class Option:
    """An option of a verb: its name, help, and what may follow it: ``values``, a file, anything, or (not ``takes``) nothing."""

    name: str
    help: str
    takes: bool
    values: tuple[str, ...]
    is_path: bool


@dataclass(frozen=True)
class Words:
    """A verb, its help, its options, and what its arguments may be."""

    verb: str
    help: str
    options: tuple[Option, ...]
    values: tuple[str, ...]


def add_options(parser: argparse.ArgumentParser) -> None:
    """The shell; it writes nothing into ``--out``."""
    parser.add_argument("shell", metavar="SHELL", choices=sorted(_SHELLS), help=f"one of {', '.join(sorted(_SHELLS))}")
    parser.set_defaults(writes=False)


def run(options: argparse.Namespace) -> int:
    """Print the script; it is made of the command line as it is now."""
    script = _SHELLS[options.shell](words())
    write_output({"shell": options.shell, "script": script}, script.rstrip(), options)
    return DONE


def words() -> list[Words]:
    """Every verb with what may follow it."""
    (kinds,) = (one for one in _parser.parser()._actions if isinstance(one, argparse._SubParsersAction))
    return [
        Words(name, _parser.verb(name).HELP, tuple(_options(sub)), tuple(_arguments(sub)))
        for name, sub in kinds.choices.items()
    ]


def _options(sub: argparse.ArgumentParser) -> Iterator[Option]:
    for action in sub._actions:
        if action.option_strings:
            values, takes = tuple(map(str, action.choices or ())), action.nargs != 0
            if action.metavar == "NAME" and "--solver" in action.option_strings:
                values = tuple(solvers.names())
            is_path = str(action.metavar or "").endswith(_PATHS) or action.dest == "case"
            yield Option(action.option_strings[-1], action.help or "", takes, values, is_path)


def _arguments(sub: argparse.ArgumentParser) -> Iterator[str]:
    for action in sub._actions:
        if not action.option_strings:
            yield from casefile.cases() if action.dest in ("case", "cases") else map(str, action.choices or ())


def _bash(verbs: list[Words]) -> str:
    """Where nothing is offered, bash completes files."""
    found = ["_fem_reference() {"]
    found += [
        '    local word="${COMP_WORDS[COMP_CWORD]}" before="${COMP_WORDS[COMP_CWORD-1]}" verb="${COMP_WORDS[1]}" offered=""'
    ]
    found += [
        '    if [ "$COMP_CWORD" -eq 1 ]; then',
        f'        offered="{" ".join(one.verb for one in verbs)} --help --version"',
    ]
    found += ["    else", '        case "$verb $before" in']
    for one in verbs:
        found += [
            f'            "{one.verb} {option.name}") offered="{" ".join(option.values)}" ;;'
            for option in one.options
            if option.takes
        ]
    found += ["            *)", '                case "$verb" in']
    for one in verbs:
        names = " ".join(option.name for option in one.options)
        found += [
            f'                    {one.verb}) offered="{" ".join(one.values)}"; [ "${{word#-}}" = "$word" ] || offered="{names}" ;;'
        ]
    found += ["                esac ;;", "        esac", "    fi"]
    found += ['    COMPREPLY=($(compgen -W "$offered" -- "$word"))', "}"]
    return "\n".join([*found, f"complete -o default -F _fem_reference {' '.join(COMMANDS)} ./fem"]) + "\n"


def _zsh(verbs: list[Words]) -> str:
    found = [f"#compdef {' '.join(COMMANDS)}", "_fem_reference() {", "    local -a offered"]
    listed = " ".join(_described(one.verb, one.help) for one in verbs)
    found += [
        "    if (( CURRENT == 2 )); then",
        f"        offered=({listed})",
        "        _describe verb offered",
        "        return",
        "    fi",
    ]
    found += ['    case "$words[2] $words[CURRENT-1]" in']
    for one in verbs:
        for option in one.options:
            if option.takes:
                offer = f"compadd -- {' '.join(option.values)}" if option.values else "_files"
                found += [f'        "{one.verb} {option.name}") {offer}; return ;;']
    found += ["    esac", '    case "$words[2]" in']
    for one in verbs:
        listed = " ".join(_described(option.name, option.help) for option in one.options)
        found += [
            f"        {one.verb}) offered=({listed}); [[ $PREFIX == -* ]] || compadd -- {' '.join(one.values)} ;;"
        ]
    found += ["    esac", "    if [[ $PREFIX == -* ]]; then _describe option offered; else _files; fi", "}"]
    return "\n".join([*found, f"compdef _fem_reference {' '.join(COMMANDS)}"]) + "\n"


def _fish(verbs: list[Words]) -> str:
    found = []
    for command in COMMANDS:
        for one in verbs:
            after = f"complete -c {command} -n '__fish_seen_subcommand_from {one.verb}'"
            found += [f"complete -c {command} -f -n __fish_use_subcommand -a {one.verb} -d {_in_fish(one.help)}"]
            found += [f"{after} -a {_in_fish(' '.join(one.values))}"] if one.values else []
            for option in one.options:
                kind = f" -x -a {_in_fish(' '.join(option.values))}" if option.values else " -r" if option.takes else ""
                found += [f"{after} -l {option.name.lstrip('-')}{kind} -d {_in_fish(option.help)}"]
    return "\n".join(found) + "\n"


def _described(name: str, text: str) -> str:
    """A word of zsh: a name and what it is."""
    return shlex.quote(f"{name}:{text.replace(':', chr(92) + ':')}")


def _in_fish(text: str) -> str:
    """A word of fish, which has an escape of its own."""
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"


_SHELLS = {"bash": _bash, "fish": _fish, "zsh": _zsh}
