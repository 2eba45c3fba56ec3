"""Cases on the command line: the choice of a case and its candidates, their pages, and the names of these pages."""

import argparse
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from fem_reference import metrics, report, solvers
from fem_reference.assessment import judge
from fem_reference.assessment.comparison import Comparison
from fem_reference.cli import DONE, SOLVER_FAILED, VERDICT_FAIL, out, write_output
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import parse
from fem_reference.problems import of_case
from fem_reference.report.asked import Asked, Part, written
from fem_reference.report.overview import comparison_text
from fem_reference.report.pages import Page
from fem_reference.scenes import casefile
from fem_reference.scenes.case import COMMAND, HOME, Candidate, Case, Expectation
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import command, fenicsx, recorded
from fem_reference.studies import by_muscle, judging, muscle_bars, refinement
from fem_reference.studies.execution import Bench


def scene_of(options: argparse.Namespace) -> Case:
    """The case with the changes of ``--set``, with the effects that it needs, and with the expectations of ``--limit``."""
    if options.negative_control and options.set:
        raise InputError("--negative-control", "this option with --set", "only one of the two")
    changes = dict(map(casefile.setting, options.set))
    read = casefile.read(options.case, with_negative_control=options.negative_control, changes=changes)
    case = of_case.chosen(read)
    units = metrics.units(against=case.standards("candidates"))
    asked = (_expectation(text, units) for text in options.limit)
    return case.expecting(tuple(asked))


def muscle_case(case: str, options: argparse.Namespace, *, quick: bool) -> MuscleCase:
    """The ``case`` of a muscle, at its quick size if ``quick``; keys changed by ``--set`` take precedence."""
    given = dict(map(casefile.setting, options.set))
    sizes = casefile.read_muscle(case, given).quick if quick else {}
    return casefile.read_muscle(case, sizes | given)


def _expectation(text: str, units: Mapping[str, str]) -> Expectation:
    """The expectation that METRIC.STATISTIC=VALUE states for every candidate. ``units``: the units of all statistics by name."""
    name, _, within = (part.strip() for part in text.partition("="))
    metric, dot, statistic = name.partition(".")
    if not dot or not within:
        raise InputError("--limit", f'"{text}"', "METRIC.STATISTIC=VALUE, such as surface_deviation.max='5 mm'")
    if name not in units:
        near = get_close_matches(name, units, n=5) or sorted(units)
        raise InputError("--limit", f'"{name}"', f"a statistic such as {', '.join(near)}")
    unit = within.lstrip("+-.0123456789eE ")
    try:
        limit = within if unit else float(within)
        judge.in_unit(limit, units[name])
    except ValueError as error:
        raise InputError("--limit", f'"{name}={within}"', f"a value in {units[name]}: {error}") from error
    table = {"of": "candidates", "metric": metric, "statistic": statistic, "truth": f"0 {unit}" if unit else 0.0}
    table |= {"within": limit, "kind": "property", "because": "requested by --limit"}
    return parse(Expectation, table, "--limit")


def own_candidates(case: Case) -> list[tuple[Candidate, str]]:
    """The candidates of the case, each with its key in the scene."""
    return [(candidate, f"candidate[{i}]") for i, candidate in enumerate(case.candidate)]


def choose(case: Case, text: str, unit: str | None) -> tuple[Candidate, str]:
    """The candidate that ``text`` names, and the key or option that chooses it.

    ``text`` is the name of a candidate of the case, a folder of recorded frames, or the name of a solver, which has its settings
    in the case or else those for Table 5.1 of the report.
    """
    names = [candidate.name for candidate in case.candidate]
    if text in names:
        if Path(text).is_dir():
            got = f'"{text}", which is both a candidate of the case and a folder'
            raise InputError("--candidate", got, f"another name, or ./{text}")
        return own_candidates(case)[names.index(text)]
    if text in solvers.names(case.task) and not Path(text).exists():
        found = solvers.choice(case, text)[1]
        return Candidate(name=text, solver=text, **found.settings), "--candidate"
    if not text or not Path(text).exists():
        raise InputError("--candidate", f'"{text}"', f"a folder of frames, a solver, or one of {', '.join(names)}")
    return recorded.choice(Path(text), unit, "--candidate"), "--candidate"


def own_solver(options: argparse.Namespace, others: Iterable[Candidate | str] = ()) -> tuple[Candidate, ...]:
    """The solver of ``--solver-command`` as a candidate; empty without the option. Its name must differ from all ``others``."""
    if options.solver_command is None:
        return ()
    own = command.choice(options.solver_command, Path.cwd(), "--solver-command")
    check_names([own.name, *(one if isinstance(one, str) else one.name for one in others)])
    return (own,)


def command_parts(own: Iterable[Candidate]) -> list[Part]:
    """The part that a command of ``--solver-command`` adds to the name of a page."""
    return [Part(("--solver-command", one.settings["command"]), one.name) for one in own]


def check_names(names: list[str]) -> None:
    """Raise InputError if two candidates have the same name, or one has the name of the reference."""
    for name in names:
        if name == "reference":
            raise InputError("--candidate", '"reference"', "another name: candidates are measured against this run")
        if names.count(name) > 1:
            raise InputError("--candidate", f'"{name}" twice', "folders and candidates with different names")


def checked_bench[C: Case](scene: C, options: argparse.Namespace, chosen: list[tuple[Candidate, str]]) -> Bench[C]:
    """The bench of a case, after checks. Raises InputError for wrong expectations, solvers or names, and if error bars are
    requested but cannot be computed.
    """
    if options.error_bar and not scene.parts:
        casefile.muscle(scene, "--error-bar")
    check_names([entry.name for entry, _ in chosen])
    for one in scene.parts or (scene,):
        judge.check(one)
    bench = Bench(scene, out(options) / "runs", options.ranks)
    bench.check(chosen)
    if options.error_bar:
        muscle_bars.check(bench)
    return bench


def case_part(case: Case) -> Part:
    """The part of a page's name for its case: the name of a shipped case, or the folder of any other case."""
    return Part((case.name if case.folder.parent == HOME / "cases" else str(case.folder),))


def changes(options: argparse.Namespace) -> tuple[Part, ...]:
    """The parts of a page's name for the changes of its case by ``--set`` and ``--negative-control``."""
    control = (Part(("--negative-control",), "negative_control"),) if options.negative_control is True else ()
    return (*(Part(("--set", text), text) for text in getattr(options, "set", ())), *control)


def asked(verb: str, case: Case, options: argparse.Namespace, page: str, *more: Part) -> Asked:
    """The request for a ``page`` of a case with its changes; ``more``: further parts of the name of the page."""
    return Asked(verb, case.name, (case_part(case), *changes(options), *more), page)


def candidates(case: Case, chosen: Iterable[Candidate]) -> tuple[Part, ...]:
    """The parts of a page's name for its candidates; none if they are the candidates of the case."""
    found = tuple(chosen)
    if found == case.candidate:
        return ()
    own = command_parts(one for one in found if one.solver == COMMAND)
    found = tuple(one for one in found if one.solver != COMMAND)
    foreign = [one.solver == "recorded" and one not in case.candidate for one in found]
    words = [one.settings["folder"] if read else one.name for one, read in zip(found, foreign, strict=True)]
    return (*own, *(Part(("--candidate", word), one.name) for word, one in zip(words, found, strict=True)))


def publish(options: argparse.Namespace, asked: Asked, page: Page, facts: dict[str, Any], text: str) -> None:
    """Print ``text`` (with ``--json`` also write ``facts``), and write a page into ``--out``, under ``--name`` if given."""
    write_output(facts, text, options)  # printed first, as writing the page may fail
    print(*written(asked, page, out(options), options.page_name)[1], sep="\n")


def judged(bench: Bench[Case], options: argparse.Namespace, chosen: list[tuple[Candidate, str]]) -> Comparison:
    """Measure and judge the runs of a case, with error bars if these are stored, requested or cheap."""
    reference, *runs = bench.runs(chosen)
    bars = refinement.offered(bench, reference, asked=options.error_bar)
    return judging.compare(bench, reference, runs, bars)


def compared(case: Case, options: argparse.Namespace, chosen: list[tuple[Candidate, str]]) -> int:
    """Measure and judge the ``chosen`` candidates, and write the page. Invalid input is reported before anything is solved."""
    bench = checked_bench(case, options, chosen)
    if case.parts:
        return _compared_muscles(bench, options, chosen)
    with fenicsx.shared():
        result = judged(bench, options, chosen)
    wanted = _page(case, options, chosen, "report")
    text = "\n".join([comparison_text(result), *unturned(options, result.word)])
    publish(options, wanted, report.of_comparison(result), report.summary(result), text)
    return status([result])


def _page(case: Case, options: argparse.Namespace, chosen: list[tuple[Candidate, str]], page: str) -> Asked:
    """The request for the ``page`` of a comparison, or of the reference alone if the case has candidates but none is chosen."""
    alone = bool(case.candidate) and not chosen
    who = (Part((), "reference"),) if alone else candidates(case, [entry for entry, _ in chosen])
    return asked("run" if alone else "compare", case, options, page, *who)


def _compared_muscles(bench: Bench[Any], options: argparse.Namespace, chosen: list[tuple[Candidate, str]]) -> int:
    """Measure and judge each of several muscles, and write a page for each."""
    with fenicsx.shared():
        found = by_muscle.compared(bench, chosen, error_bars=options.error_bar)
    case, texts, pages = bench.scene, list[str](), list[str]()
    facts: dict[str, Any] = {"case": case.name, "muscles": {}}
    for name, result in found.muscles.items():
        texts.append(f"{name}:\n{comparison_text(result)}")
        facts["muscles"][name] = report.summary(result)
    facts["penetration"], word = found.penetration, judge.overall(result.word for result in found.muscles.values())
    texts += [
        f"{who}: {one} and {other} penetrate each other by {depth:.3g} mm (frame {frame})"
        for who, one, other, depth, frame in found.worst
    ]
    texts += [f"{who}: no frames of {muscle}, which is not judged" for who, muscle in found.lacking]
    facts["lacking"] = [{"solver": who, "muscle": muscle} for who, muscle in found.lacking]
    write_output(facts, "\n".join([*texts, by_muscle.ALONE, *unturned(options, word)]), options)
    for name, result in found.muscles.items():
        wanted = _page(case, options, chosen, f"report_{name}")
        pages += written(wanted, report.of_comparison(result), out(options), options.page_name)[1]
    print(*pages, sep="\n")
    return status(found.muscles.values())


def unturned(options: argparse.Namespace, word: str) -> list[str]:
    """A line for a negative control that did not turn the verdict to fail; no line otherwise."""
    if not options.negative_control or word == "fail":
        return []
    why = "its change is not judged here (compare judges candidates too), or is too small"
    return [f"negative control: the verdict is {word} but should be fail: {why}"]


def status(results: Iterable[Comparison]) -> int:
    """The exit status of comparisons."""
    found = tuple(results)
    if any(run.outcome.status != "converged" for result in found for run in result.runs):
        return SOLVER_FAILED
    return VERDICT_FAIL if any(result.word == "fail" for result in found) else DONE


def lines(facts: dict[str, Any], indent: str = "") -> list[str]:
    """Nested facts as indented lines."""
    printed = []
    for key, value in facts.items():
        if isinstance(value, dict):
            printed += [f"{indent}{key}:", *lines(value, indent + "  ")]
        elif isinstance(value, list):
            printed += [f"{indent}{key}:", *(f"{indent}  {entry}" for entry in value)]
        else:
            printed.append(f"{indent}{key}: {value:.6g}" if isinstance(value, float) else f"{indent}{key}: {value}")
    return printed
