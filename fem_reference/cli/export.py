"""The verb ``export``: a case for another solver, or its runs for ParaView."""

import argparse
from pathlib import Path

from fem_reference import export
from fem_reference.cli import DONE, SOLVER_FAILED, out, write_output
from fem_reference.cli._cases import checked_bench, choose, lines, scene_of
from fem_reference.cli._parser import share
from fem_reference.export import paraview
from fem_reference.export.folders import check
from fem_reference.foundations.errors import InputError
from fem_reference.report.words import duration
from fem_reference.runs import states
from fem_reference.runs.store import Run
from fem_reference.scenes import casefile
from fem_reference.scenes.case import Case
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies import by_muscle, judging, refinement
from fem_reference.studies.execution import Bench

HELP = "write all data that another solver needs, in open formats; or runs for ParaView"
PARAVIEW = "paraview"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for the folder and the formats."""
    share(parser, "case", "--set")
    folder = "a new or empty folder"
    parser.add_argument("--to", type=Path, required=True, metavar="DIR", help=folder)
    forms = "only open formats (default); FEBio's format too; or the solved reference and candidates for ParaView"
    parser.add_argument("--format", choices=(*export.FORMATS, PARAVIEW), default="open", help=forms)
    either = f"for {PARAVIEW}: a candidate of the case, a folder of frames or a solver; may be repeated"
    parser.add_argument("--candidate", action="append", default=[], metavar="NAME|DIR", help=either)
    share(parser, "--unit")
    again = f"for {PARAVIEW}: solve the reference again if its stored run has no states"
    parser.add_argument("--solve", action="store_true", help=again)
    share(parser, "--ranks")


def run(options: argparse.Namespace) -> int:
    """Write a case for another solver, or its runs for ParaView."""
    scene = scene_of(options)
    if options.format == PARAVIEW:
        return _runs_of_several(scene, options) if scene.parts else _runs(casefile.muscle(scene), options)
    if options.candidate or options.unit or options.solve:
        got = f"--candidate, --unit or --solve for {options.format}"
        raise InputError("export", got, f"none of them: they are for {PARAVIEW} only")
    bench = Bench(scene if scene.parts else casefile.muscle(scene), out(options) / "runs")
    written = export.export(bench.scene, bench.problem, options.to, options.format)
    facts = {"case": scene.name, "folder": str(options.to), "files": written}
    write_output(facts, "\n".join(lines(facts)), options)
    return DONE


def _runs(case: MuscleCase, options: argparse.Namespace) -> int:
    """Write the reference with its states, and the candidates, for ParaView."""
    check(options.to)
    chosen = [choose(case, text, options.unit) for text in options.candidate]
    bench = checked_bench(case, options, chosen)
    reference = _with_states(bench, again=options.solve)
    runs = [bench.obtain(entry.name, entry, place) for entry, place in chosen]
    result = judging.compare(bench, reference, runs, refinement.stored(reference))
    written = paraview.write(result, options.to)
    facts = {"case": case.name, "index": str(options.to / paraview.INDEX), "files": len(written)}
    write_output(facts, "\n".join(lines(facts)), options)
    return DONE if all(one.outcome.status == "converged" for one in result.runs) else SOLVER_FAILED


def _runs_of_several(case: Case, options: argparse.Namespace) -> int:
    """Write the reference and the candidates of each muscle for ParaView, without states, into a folder with the muscle's name."""
    check(options.to)
    if options.solve:
        want = "a case with one muscle, because states of several muscles are not written"
        raise InputError("--solve", "several muscles", want)
    chosen = [choose(case, text, options.unit) for text in options.candidate]
    found = by_muscle.compared(checked_bench(case, options, chosen), chosen)
    count = sum(len(paraview.write(one, options.to / name)) for name, one in found.muscles.items())
    indices = [str(options.to / name / paraview.INDEX) for name in found.muscles]
    facts = {"case": case.name, "index": indices, "files": count}
    write_output(facts, "\n".join(lines(facts)), options)
    every = (run for one in found.muscles.values() for run in one.runs)
    return DONE if all(one.outcome.status == "converged" for one in every) else SOLVER_FAILED


def _with_states(bench: Bench[MuscleCase], *, again: bool) -> Run:
    """The reference with its states. A reference whose states were not stored is solved again if ``again`` is True; otherwise
    InputError is raised.
    """
    choice = bench.scene.reference
    if not hasattr(bench.settings(choice, "reference"), "store_state"):
        return bench.reference()
    known = bench.known("reference", choice.model_copy(update={"store_state": None}), "reference")
    if known and known.folder and not again and not states.are_kept(known.folder, known.numbers):
        took = duration(known.outcome.cost.get("seconds"))
        got = f"a reference that was solved without storing the states that stress and pressure need ({known.folder})"
        raise InputError("export", got, f"--solve, which solves it again (last time this took {took})")
    return bench.obtain("reference", choice.model_copy(update={"store_state": True}), "reference")
