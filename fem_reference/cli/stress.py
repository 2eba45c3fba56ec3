"""The verb ``stress``: the stability of every solver on hard cases."""

import argparse
from collections.abc import Collection
from pathlib import Path

from fem_reference.assessment.stress import facts
from fem_reference.cli import DONE
from fem_reference.cli._cases import check_names, command_parts, own_solver, publish
from fem_reference.cli._parser import share
from fem_reference.foundations.errors import InputError
from fem_reference.report import stress_page
from fem_reference.report.asked import Asked, Part
from fem_reference.scenes.case import COMMAND, Candidate
from fem_reference.studies import standings
from fem_reference.studies.hard import records, running

HELP = "run the hard cases with every solver, and write a page that shows which solvers stay stable"


def add_options(parser: argparse.ArgumentParser) -> None:
    which = "a hard case, or a folder of several variants, below cases/hard (default: all, about 15 minutes)"
    parser.add_argument("names", metavar="NAME", nargs="*", help=which)
    only = "only this solver; may be repeated (default: all)"
    parser.add_argument("--solver", default=[], choices=[*records.choices(), COMMAND], metavar="NAME", help=only)
    program = "a program in a folder, as in standings; without --solver only such programs run; may be repeated"
    parser.add_argument("--program", action="append", default=[], type=Path, metavar="DIR", help=program)
    many = "solve the farthest frame of frictionless cases with 1, 10 and 40 load steps too (reference only); results must agree"
    parser.add_argument("--steps", action="store_true", help=many)
    meshes = "run the reference on N randomly perturbed meshes of each case as well"
    parser.add_argument("--jitters", type=int, default=0, metavar="N", help=meshes)
    share(parser, "--solver-command", "--name")


def run(options: argparse.Namespace) -> int:
    """Run the hard cases and write the page; a run that fails is a result, not a failure of the verb."""
    if options.jitters < 0:
        raise InputError("--jitters", options.jitters, "0 or more")
    for name, wanted in (("--steps", options.steps), ("--jitters", options.jitters)):
        if wanted and options.solver and records.REFERENCE not in options.solver:
            want = f"--solver {records.REFERENCE} too, the only solver that this option affects"
            raise InputError(name, f"this option with {', '.join(options.solver)} alone", want)
    hard = records.read_all(tuple(options.names))
    commanded, programs = own_solver(options, list(records.choices())), [*map(standings.program, options.program)]
    own = dict[Candidate, Collection[str] | None](dict.fromkeys(commanded))
    own |= {one.candidate: one.takes if one.law else None for one in programs}
    check_names([*records.choices(), *(one.name for one in own)])
    only = options.solver or [COMMAND] * bool(programs)
    found = running.run(hard, only, own, in_steps=options.steps, jitters=options.jitters)
    parts = [Part((name,), name) for name in options.names]
    parts += [Part(("--solver", name), name) for name in options.solver]
    parts += command_parts(commanded)
    parts += [Part(("--program", str(folder)), folder.resolve().name) for folder in options.program]
    parts += [Part(("--steps",), "steps")] if options.steps else []
    parts += [Part(("--jitters", str(options.jitters)), "jitters")] if options.jitters else []
    asked = Asked("stress", "stress", tuple(parts))
    publish(options, asked, stress_page.page(found), facts(found), stress_page.text(found))
    return DONE
