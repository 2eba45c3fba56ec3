"""The verbs for scalar cases; they return their output."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fem_reference import report
from fem_reference.foundations.errors import InputError
from fem_reference.report.overview import field_example_facts, field_facts, field_text
from fem_reference.scenes import casefile
from fem_reference.scenes.case import SolverChoice
from fem_reference.scenes.scalar import ScalarCase
from fem_reference.studies import scalar

PAGES = {
    "octave-examples": (
        "The report's Octave examples",
        ("rod", "rod_advection", "plate_square", "plate_spiral", "surface_figure"),
    )
}


@dataclass(frozen=True)
class Printed:
    """What is to be printed: ``facts`` as JSON, ``text`` for people, and the ``word`` that the exit status follows (``"failed"``
    where a solver did, else the verdict).
    """

    facts: dict[str, Any]
    text: str
    word: str


def run(scene: ScalarCase, solver: str | None, out: Path) -> Printed:
    """A scalar case by its reference, with a page, or by another ``solver`` or the candidate of that name: what can be measured
    without another run, judged.
    """
    if solver is None or solver == scene.reference.solver:
        return compare(scene, [], out)
    bench = scalar.FieldBench(scene, out / "runs")
    named = [entry for entry in scene.candidate if entry.solver == solver]
    named += [entry for entry in scene.candidate if entry.name == solver]
    if named:
        name, choice = named[0].name, SolverChoice(solver=named[0].solver, **named[0].settings)
    else:
        name, choice = solver, SolverChoice(solver=solver)
    made = bench.obtain(name, choice)
    measures = scalar.measure(scene, made, None)
    facts = field_facts(scene, [made], measures, scalar.judged(scene, measures))
    return Printed(facts, field_text(facts), _word([facts]))


def compare(scene: ScalarCase, candidates: list[str] | None, out: Path) -> Printed:
    """A scalar case with its reference, ``candidates`` (None for all) and convergence, on a page of its own."""
    known = [candidate.name for candidate in scene.candidate]
    for name in candidates or []:
        if name not in known:
            raise InputError("--candidate", f'"{name}"', f"one of {', '.join(known)}")
    example = scalar.example(scene, out / "runs", candidates)
    facts, path = field_example_facts(example), out / scene.name / "report.html"
    report.write_examples(scene.title, (example,), path, differences=False)
    return Printed(facts, f"{field_text(facts)}\npage: {path}", _word([facts]))


def page(name: str, out: Path) -> Printed:
    """The page ``name`` over several cases."""
    title, names = PAGES[name]
    scenes = [scene for scene in map(casefile.read, names) if isinstance(scene, ScalarCase)]
    examples = tuple(scalar.example(scene, out / "runs") for scene in scenes)
    facts, path = [field_example_facts(example) for example in examples], out / f"{name}.html"
    report.write_examples(title, examples, path, differences=True)
    text = "\n\n".join([*map(field_text, facts), f"page: {path}"])
    return Printed({"page": str(path), "cases": facts}, text, _word(facts))


def _word(facts: list[dict[str, Any]]) -> str:
    if any(status != "converged" for entry in facts for status in entry["statuses"].values()):
        return "failed"
    return "fail" if any(entry["verdict"] == "fail" for entry in facts) else "pass"
