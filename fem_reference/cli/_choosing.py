"""Choices of the command line: a scene, candidates of it, and the bench that they are solved on."""

import argparse
from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path

from fem_reference import metrics, solvers
from fem_reference.assessment import judge
from fem_reference.cli._printing import out
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import parse
from fem_reference.problems import of_case
from fem_reference.scenes import casefile
from fem_reference.scenes.case import Candidate, Case, Expectation
from fem_reference.solvers import recorded
from fem_reference.studies.execution import Bench


def scene_of(options: argparse.Namespace) -> Case:
    """The scene of the case, with what ``--set`` changes of it and the effects that it needs."""
    if options.negative_control and options.set:
        raise InputError("--negative-control", "with --set", "one of the two")
    changes = dict(map(casefile.setting, options.set))
    return of_case.chosen(casefile.read(options.case, with_negative_control=options.negative_control, changes=changes))


def with_limits(case: Case, limits: list[str]) -> Case:
    """The case, expecting of every candidate too that statistics deviate no more than ``limits``, METRIC.STATISTIC=VALUE each."""
    units = metrics.units(against=case.standards("candidates"))
    asked = (_expectation(text, units) for text in limits)
    return case.model_copy(update={"expect": (*case.expect, *asked)})


def _expectation(text: str, units: Mapping[str, str]) -> Expectation:
    """The expectation by METRIC.STATISTIC=VALUE of every candidate; ``units`` of the statistics that there are."""
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
    table |= {"within": limit, "kind": "property", "because": "asked for by --limit"}
    return parse(Expectation, table, "--limit")


def own_candidates(case: Case) -> list[tuple[Candidate, str]]:
    """The candidates of the case, each with its place."""
    return [(candidate, f"candidate[{i}]") for i, candidate in enumerate(case.candidate)]


def choose(case: Case, text: str, unit: str | None) -> tuple[Candidate, str]:
    """The candidate of the case with this name, else the recorded frames in this folder, else the solver of this name with the
    settings of the page table-5-1; and the place that chooses it.
    """
    names = [candidate.name for candidate in case.candidate]
    if text in names:
        if Path(text).is_dir():
            got = f'"{text}", a candidate of the case and a folder'
            raise InputError("--candidate", got, f"another name, or ./{text}")
        return case.candidate[names.index(text)], f"candidate[{names.index(text)}]"
    if text in solvers.names(case.task) and not Path(text).exists():
        found = solvers.choice(case, text)[1]
        return Candidate(name=text, solver=text, **found.settings), "--candidate"
    if not text or not Path(text).exists():
        raise InputError("--candidate", f'"{text}"', f"a folder of frames, a solver, or one of {', '.join(names)}")
    return recorded.choice(Path(text), unit, "--candidate"), "--candidate"


def check_names(names: list[str]) -> None:
    """InputError where two candidates have one name, or one has that of the reference."""
    for name in names:
        if name == "reference":
            raise InputError("--candidate", '"reference"', "another name: this is what candidates are measured against")
        if names.count(name) > 1:
            raise InputError("--candidate", f'"{name}" twice', "folders and candidates of different names")


def refuse_error_bar(case: Case, options: argparse.Namespace) -> None:
    """InputError where error bars are wanted of what has none."""
    if options.error_bar:
        casefile.muscle(case, "--error-bar")


def checked_bench[C: Case](scene: C, options: argparse.Namespace, chosen: list[tuple[Candidate, str]]) -> Bench[C]:
    """The bench of a scene whose expectations, reference and ``chosen`` candidates can all be read."""
    judge.check(scene)
    bench = Bench(scene, out(options) / "runs", options.ranks)
    bench.check(chosen)
    return bench
