"""The command line: the only place that prints, shows progress and exits."""

import argparse
import json
import logging
import os
import re
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fem_reference import __version__, casefile, field_verbs, files, judge, metrics, refinement, report, runs, solvers
from fem_reference.comparison import compare
from fem_reference.errors import InputError, MissingSoftware
from fem_reference.execution import Bench, complete
from fem_reference.field.scene import FieldScene
from fem_reference.field_execution import FieldBench
from fem_reference.field_verbs import Told
from fem_reference.overview import comparison_text, field_scene_facts, run_facts, run_text, scene_facts
from fem_reference.records import parse
from fem_reference.scene import Candidate, Scene, SolverChoice
from fem_reference.verification import verb as verification

DONE, VERDICT_FAIL, BAD_INPUT, SOLVER_FAILED = range(4)
INTERRUPTED, TERMINATED = 130, 143  # what shells report for them
MAIN_JOB = "hip_flexion"


def entry() -> None:
    """The installed command."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(TERMINATED))  # so that what is under way is cleaned up
    sys.exit(main(sys.argv[1:]))


def main(arguments: list[str]) -> int:
    """Carry out a command line; returns the exit status."""
    options = _parser().parse_args(arguments)
    _show_progress(on=not options.quiet)
    try:
        _check_outputs(options)
        status: int = options.verb(options)
    except (InputError, OSError) as error:
        print(f"fem-reference: {error}", file=sys.stderr)
        return BAD_INPUT
    except MissingSoftware as error:
        print(f"fem-reference: {error}", file=sys.stderr)
        return SOLVER_FAILED
    except KeyboardInterrupt:
        print("fem-reference: interrupted; a run that was not finished is solved again next time", file=sys.stderr)
        return INTERRUPTED
    return status


def _check_outputs(options: argparse.Namespace) -> None:
    """InputError where an output cannot be written, before anything is measured; makes nothing."""
    _check_folder("--out", _out(options), written=options.verb is not _list)
    if options.json is None:
        return
    if options.json.is_dir():
        raise InputError("--json", f'"{options.json}", a folder', "a file")
    if not options.json.exists():
        _check_folder("--json", options.json.parent, written=True)


def _check_folder(place: str, folder: Path, *, written: bool) -> None:
    """InputError at ``place`` unless ``folder`` is one or can be made, and can be written into where it will be."""
    there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not there.is_dir():
        raise InputError(place, f'"{folder}", where "{there}" is a file', "a folder")
    if written and not os.access(there, os.W_OK | os.X_OK):
        raise InputError(place, f'"{folder}", where "{there}" cannot be written into', "a folder that can")


def _show_progress(*, on: bool) -> None:
    """Our own log lines, and nobody else's, on standard error."""
    log = logging.getLogger("fem_reference")
    log.setLevel(logging.INFO if on else logging.WARNING)
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(message)s"))
    log.handlers[:] = [handler]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="fem-reference", description="Finite element reference and validation for muscle deformation."
    )
    parser.add_argument("--version", action="version", version=f"fem-reference {__version__}")
    verbs = parser.add_subparsers(metavar="VERB", required=True)

    def add(
        name: str, verb: Callable[[argparse.Namespace], int], text: str, *, case: bool = True
    ) -> argparse.ArgumentParser:
        sub = verbs.add_parser(name, help=text, description=text)
        if case:
            sub.add_argument("case", metavar="CASE", help="a shipped case (see list), a case folder or a case.toml")
            change = "change a key of the case, such as muscle.tet_size='8 mm'; may be repeated"
            sub.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help=change)
        sub.add_argument("--out", type=Path, metavar="DIR", help="where pages and stored runs go (default: reports)")
        sub.add_argument("--json", type=Path, metavar="FILE", help="write what is printed as JSON")
        sub.add_argument("--quiet", action="store_true", help="show no progress")
        sub.set_defaults(verb=verb, ranks=None, error_bar=False)
        return sub

    demo = add("demo", _demo, f"the main job: the case {MAIN_JOB}, its reference against its candidates", case=False)
    run = add("run", _run, "solve a case and judge what it expects of the reference")
    run.add_argument("--solver", metavar="NAME", help="another solver than the case's own reference")
    comparison = add("compare", _compare, "measure candidates against the reference and write the page")
    comparison.add_argument(
        "--candidate",
        action="append",
        metavar="NAME|DIR",
        help="a candidate of the case or a folder of frames; may be repeated",
    )
    comparison.add_argument("--unit", default="mm", help="unit of length of the frames in DIR (default: mm)")
    for judging in (run, comparison):
        known = "how well the reference is known: solve it on coarser tetrahedra and with finer steps too"
        judging.add_argument("--error-bar", action="store_true", help=known)
    for solving in (demo, run, comparison):
        ranks = "MPI processes of the reference (default: 2 where there are)"
        solving.add_argument("--ranks", type=int, metavar="N", help=ranks)
    page = add("page", _page, "write a page over several cases", case=False)
    page.add_argument(
        "name", metavar="NAME", choices=sorted(field_verbs.PAGES), help=f"one of {', '.join(sorted(field_verbs.PAGES))}"
    )
    catalogue = add("verify", _verify, "measure problems whose answers are known and write the page", case=False)
    known = "an entry, a family or a shell pattern of them (default: all)"
    catalogue.add_argument("names", metavar="NAME", nargs="*", help=known)
    spoil = "measure this entry with its one thing wrong, named or not: it must fail; may be repeated"
    catalogue.add_argument("--spoil", action="append", default=[], metavar="NAME", help=spoil)
    add("list", _list, "what there is: cases, solvers, metrics, stored runs", case=False)
    add("show", _show, "what a case is made of; with --out also its meshes for ParaView")
    return parser


def _demo(options: argparse.Namespace) -> int:
    scene = casefile.read_muscle(MAIN_JOB)
    return _judge(scene, options, _own_candidates(scene))


def _own_candidates(scene: Scene) -> list[tuple[Candidate, str]]:
    """The candidates of the scene, each with its place."""
    return [(candidate, f"candidate[{i}]") for i, candidate in enumerate(scene.candidate)]


def _compare(options: argparse.Namespace) -> int:
    scene = _scene(options)
    if isinstance(scene, FieldScene):
        _refuse_error_bar(options)
        return _told(field_verbs.compare(scene, options.candidate, _out(options)), options)
    wanted = options.candidate or [candidate.name for candidate in scene.candidate]
    return _judge(scene, options, [_candidate(scene, text, options.unit) for text in wanted])


def _candidate(scene: Scene, text: str, unit: str) -> tuple[Candidate, str]:
    """The candidate of the scene with this name, else the recorded frames in this folder; and the place that chooses it."""
    names = [candidate.name for candidate in scene.candidate]
    if text in names:
        return scene.candidate[names.index(text)], f"candidate[{names.index(text)}]"
    path = Path(text)
    if not path.exists():
        raise InputError("--candidate", f'"{text}"', f"a folder of frames, or one of {', '.join(names)}")
    folder = path.resolve()
    name = re.sub(r"[^\w.-]+", "_", folder.stem if folder.is_file() else folder.name) or "candidate"
    table = {"name": name, "solver": "recorded", "folder": str(folder), "unit": unit}
    return parse(Candidate, table, "--candidate"), "--candidate"


def _run(options: argparse.Namespace) -> int:
    scene = _scene(options)
    if isinstance(scene, FieldScene):
        _refuse_error_bar(options)
        return _told(field_verbs.run(scene, options.solver, _out(options)), options)
    if options.solver is None or options.solver == scene.reference.solver:
        return _judge(scene, options, [])
    _refuse_error_bar(options)
    bench = Bench(scene, _out(options) / "runs", options.ranks)
    run = bench.obtain(options.solver, _choice(scene, options.solver), f"--solver {options.solver}")
    _tell(run_facts(scene, run), run_text(run), options)
    return DONE if run.outcome.status == "converged" else SOLVER_FAILED


def _refuse_error_bar(options: argparse.Namespace) -> None:
    if options.error_bar:
        raise InputError("--error-bar", "a scalar case or another solver", "the reference of a muscle")


def _choice(scene: Scene, solver: str) -> SolverChoice:
    """How the scene chooses ``solver``: its settings as a candidate, else no settings."""
    return next((entry for entry in scene.candidate if entry.solver == solver), SolverChoice(solver=solver))


def _scene(options: argparse.Namespace) -> Scene | FieldScene:
    """The scene of the case, with what ``--set`` changes of it."""
    return casefile.read(options.case, changes=dict(map(casefile.setting, options.set)))


def _told(told: Told, options: argparse.Namespace) -> int:
    """Tell what came of scalar cases or of a verification; returns the exit status."""
    _tell(told.facts, told.text, options)
    if told.word == "failed":
        return SOLVER_FAILED
    return VERDICT_FAIL if told.word == "fail" else DONE


def _page(options: argparse.Namespace) -> int:
    return _told(field_verbs.page(options.name, _out(options)), options)


def _verify(options: argparse.Namespace) -> int:
    measured = verification.verify(options.names, options.spoil)
    status = _told(verification.told(measured), options)  # what took so long to measure is told whatever the page does
    name = "verify_part" if options.names or options.spoil else "verify"  # a part does not stand in the whole's place
    print(f"page: {report.write_verification(measured, _out(options), name)}")
    return status


def _judge(scene: Scene, options: argparse.Namespace, chosen: list[tuple[Candidate, str]]) -> int:
    """Reference and candidates -> page, JSON and exit status. What is bad in the input shows before anything is solved."""
    names = ["reference", *(entry.name for entry, _ in chosen)]
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                "--candidate", f'"{name}" twice', 'folders and candidates of different names, none of them "reference"'
            )
    bench = _checked_bench(scene, options, chosen)
    read = {entry.name: bench.read(entry.name, entry, place) for entry, place in chosen if entry.solver == "recorded"}
    reference = bench.obtain("reference", scene.reference, "reference")
    solved = {
        entry.name: bench.obtain(entry.name, entry, place) for entry, place in chosen if entry.solver != "recorded"
    }
    bars = refinement.obtain(bench, reference) if options.error_bar else refinement.stored(reference)
    numbers = scene.frames.numbers
    candidates = tuple(complete((read | solved)[entry.name], numbers) for entry, _ in chosen)
    result = compare(scene, bench.setup(), complete(reference, numbers), candidates, bars)
    page = report.write(result, _out(options) / scene.name)
    _tell(report.summary(result), comparison_text(result, page), options)
    if any(run.outcome.status != "converged" for run in (reference, *candidates)):
        return SOLVER_FAILED
    return VERDICT_FAIL if result.word == "fail" else DONE


def _checked_bench(scene: Scene, options: argparse.Namespace, chosen: list[tuple[Candidate, str]]) -> Bench:
    """The bench of a scene whose expectations, reference and ``chosen`` candidates can all be read."""
    judge.check(scene)
    bench = Bench(scene, _out(options) / "runs", options.ranks)
    for choice, place in [(scene.reference, "reference"), *chosen]:
        bench.settings(choice, place)
    return bench


def _list(options: argparse.Namespace) -> int:
    scenes = {name: casefile.read(name).title for name in casefile.cases()}
    stored = [_stored(path.parent) for path in sorted((_out(options) / "runs").glob("*/*/run.json"))]
    facts = {"cases": scenes, "solvers": solvers.names(), "metrics": metrics.names(), "runs": stored}
    width = max(map(len, scenes))
    lines = ["cases:", *(f"  {name:{width}}  {title}" for name, title in scenes.items())]
    lines += [f"solvers: {', '.join(facts['solvers'])}", f"metrics: {', '.join(facts['metrics'])}"]
    lines += ["stored runs:", *(f"  {path}" for path in stored)] if stored else []
    _tell(facts, "\n".join(lines), options)
    return DONE


def _stored(folder: Path) -> str:
    """A stored run, with its status where it did not converge."""
    status = runs.status(folder)
    return str(folder) if status == "converged" else f"{folder} ({status})"


def _show(options: argparse.Namespace) -> int:
    scene = _scene(options)
    if isinstance(scene, FieldScene):
        facts = field_scene_facts(scene, FieldBench(scene, _out(options)).problem)
        _tell(facts, "\n".join(_lines(facts)), options)
        return DONE
    bench = _checked_bench(scene, options, _own_candidates(scene))
    facts = scene_facts(scene, bench.setup())
    if options.out is not None:
        built, folder = bench.problem(), options.out / scene.name
        folder.mkdir(parents=True, exist_ok=True)
        files.write_surface(folder / "surface.vtp", built.surface, built.surface.points)
        files.write_polylines(folder / "fibres.vtp", built.fibres, built.fibres.points)
        files.write_tets(folder / "tets.vtu", built.mesh, built.mesh.points)
        facts |= {"mesh": built.mesh_facts, "folder": str(folder)}
    _tell(facts, "\n".join(_lines(facts)), options)
    return DONE


def _lines(facts: dict[str, Any], indent: str = "") -> list[str]:
    lines = []
    for key, value in facts.items():
        if isinstance(value, dict):
            lines += [f"{indent}{key}:", *_lines(value, indent + "  ")]
        elif isinstance(value, list):
            lines += [f"{indent}{key}:", *(f"{indent}  {entry}" for entry in value)]
        else:
            lines.append(f"{indent}{key}: {value:.6g}" if isinstance(value, float) else f"{indent}{key}: {value}")
    return lines


def _out(options: argparse.Namespace) -> Path:
    return options.out if options.out is not None else Path("reports")


def _tell(facts: dict[str, Any], text: str, options: argparse.Namespace) -> None:
    print(text)
    if options.json is not None:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        files.write_text(options.json, json.dumps(facts, indent=1, allow_nan=False))
