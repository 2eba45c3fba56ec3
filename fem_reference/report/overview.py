"""The contents of a case and the results of scalar ones, in words and numbers: what ``show``, ``run`` and ``compare`` print."""

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.error_bars import ErrorBar
from fem_reference.assessment.judge import overall
from fem_reference.assessment.scalar_example import Example, FieldMeasure, FieldVerdict
from fem_reference.assessment.solver_table import Table
from fem_reference.effects import Effect
from fem_reference.foundations.mesh import Surface, enclosed_volume
from fem_reference.foundations.motion import RigidMotion, Translation
from fem_reference.geometry.sectors import attached_area, attached_shares
from fem_reference.metrics import find
from fem_reference.problems.muscle import AttachedVertices, RigidBody, Setup
from fem_reference.problems.scalar import FieldProblem
from fem_reference.report.words import exact
from fem_reference.runs.scalar import FieldRun
from fem_reference.runs.store import Run
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.scenes.scalar import ScalarCase

# The statistics that are printed of a comparison; the page, JSON and CSV have them all.
TOLD = (
    ("volume", "deviation"),
    ("fibre_length", "max"),
    ("surface_deviation", "rms"),
    ("surface_deviation", "p95"),
    ("surface_deviation", "max"),
    ("surface_deviation", "hausdorff"),
    ("penetration", "deepest"),
)


def scene_facts(scene: MuscleCase, setup: Setup) -> dict[str, Any]:
    """Everything that a person asks of a case before solving it, as words and numbers by name."""
    surface = setup.surface
    return {
        "case": scene.name,
        "title": scene.title,
        "proves": scene.proves,
        "muscle": {
            "triangles": len(surface.triangles),
            "volume_mm3": enclosed_volume(surface.points, surface.triangles),
            "tet_size_mm": scene.muscle.tet_size,
            "refinements": scene.muscle.refinements,
            "mesher": scene.muscle.mesher,
        },
        "bones": {bone.name: f"{_shape(bone)}, {_motion(bone.motion)}" for bone in setup.bones},
        "attachments": {
            one.attachment: f"{len(one.vertices)} vertices, {_area(surface, one):.0f} mm2, attached to {one.bone.name} "
            + ("exactly" if one.stiffness is None else f"by springs of {one.stiffness:g} MPa/mm")
            for one in setup.attached
        },
        "effects": {effect.title: _parameters(effect) for effect in scene.effects},
        "frames": f"{scene.frames.first} to {scene.frames.last}, every {scene.frames.every}",
        "reference": " ".join([scene.reference.solver, *(f"{k}={v}" for k, v in scene.reference.settings.items())]),
        "candidates": {candidate.name: candidate.solver for candidate in scene.candidate},
        "expects": [
            f"{e.of} {e.metric} {e.statistic} at frame {e.frame}: {e.truth} within {e.within} ({e.kind})"
            for e in scene.expect
        ],
    }


def _area(surface: Surface, attached: AttachedVertices) -> float:
    return attached_area(surface, attached_shares(surface, attached.vertices))


def _parameters(effect: Effect) -> dict[str, str]:
    return {name: f"{exact(value)} {unit}".rstrip() for name, value, unit in effect.parameters}


def _shape(bone: RigidBody) -> str:
    """How fine the surface of a bone is, or what its closed form is."""
    if bone.solid is None:
        return f"{len(bone.surface.triangles)} triangles"
    kind = "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in type(bone.solid).__name__)
    values = ", ".join(f"{name} {_number_or_three(value)}" for name, value in vars(bone.solid).items())
    return f"{kind.strip()} of {values}, mm"


def _number_or_three(value: Any) -> str:
    return f"({', '.join(f'{entry:g}' for entry in value)})" if isinstance(value, tuple) else f"{value:g}"


def _motion(motion: RigidMotion | None) -> str:
    if motion is None:
        return "rests"
    if isinstance(motion, Translation):
        stops = zip(motion.frames, motion.distances, strict=True)
        keys = ", ".join(f"{distance:g} at {frame:g}" for frame, distance in stops)
        return f"slides along {_number_or_three(motion.direction)}, mm at frame: {keys}"
    x, y, z = motion.centre
    keys = ", ".join(f"{angle:g} at {frame:g}" for frame, angle in zip(motion.frames, motion.angles, strict=True))
    return f"turns about ({x:g}, {y:g}, {z:g}) mm along {motion.axis}, rad at frame: {keys}"


def field_scene_facts(scene: ScalarCase, problem: FieldProblem) -> dict[str, Any]:
    """Everything that a person asks of a scalar case before solving it."""
    return {
        "case": scene.name,
        "title": scene.title,
        "proves": scene.proves,
        "domain": f"{len(problem.mesh.cells)} cells, {len(problem.mesh.points)} vertices, size {problem.mesh.sizes.sum():.6g}",
        "element": f"P{problem.order}, {len(problem.fixed)} nodes, {_fixed(problem)} fixed",
        "form": f"{'galerkin' if problem.tau is None else 'supg'}, mesh Peclet number up to {problem.peclet:.3g}",
        "effects": {
            type(effect).__name__: {name: str(value) for name, value in effect.model_dump().items()}
            for effect in scene.effects
        },
        "reference": scene.reference.solver,
        "candidates": {candidate.name: candidate.solver for candidate in scene.candidate},
        "expects": [f"{e.of} {e.metric}: {e.truth} within {e.within} ({e.kind})" for e in scene.expect],
    }


def _fixed(problem: FieldProblem) -> int:
    return sum(not math.isnan(value) for value in problem.fixed)


def field_facts(
    scene: ScalarCase, runs: Iterable[FieldRun], measures: Iterable[FieldMeasure], verdicts: Iterable[FieldVerdict]
) -> dict[str, Any]:
    """What came of the runs of a scalar case, the first of them in front, as JSON has it."""
    listed, judged = list(runs), list(verdicts)
    first = listed[0]
    return {
        "case": scene.name,
        "solver": first.solver,
        "status": first.solution.outcome.status,
        "message": first.solution.outcome.message,
        "statuses": {run.name: run.solution.outcome.status for run in listed},
        "verdict": overall(verdict.word for verdict in judged),  # type: ignore[misc]
        "cost": {run.name: run.solution.outcome.cost for run in listed},
        "measures": [
            {
                "candidate": entry.of,
                "metric": entry.measure,
                "value": entry.value if math.isfinite(entry.value) else None,
            }
            for entry in measures
        ],
        "verdicts": [
            {"word": v.word, "of": v.expectation.of, "metric": v.expectation.metric, "truth": v.expectation.truth}
            | {"within": v.expectation.within, "value": v.value if math.isfinite(v.value) else None}
            for v in judged
        ],
        "runs": [str(run.folder) for run in listed],
    }


def field_text(facts: dict[str, Any]) -> str:
    """The same for people."""
    lines = [f"{facts['case']}: {facts['status']}, {facts['message']}"]
    lines += [f"{row['candidate']} {row['metric']}: {_number(row['value'])}" for row in facts["measures"]]
    lines += [
        f"{v['word']}: {v['of']} {v['metric']} is {_number(v['value'])}, expected {v['truth']} within {v['within']}"
        for v in facts["verdicts"]
    ]
    return "\n".join([*lines, f"verdict: {facts['verdict']}", *(f"stored in {folder}" for folder in facts["runs"])])


def field_example_facts(example: Example) -> dict[str, Any]:
    """What came of a whole example, its convergence included."""
    ladders = [
        {
            "element": ladder.element,
            "cells": ladder.cells,
            "errors": [error if math.isfinite(error) else None for error in ladder.errors],
            "against": ladder.against,
        }
        | {"order": ladder.order if math.isfinite(ladder.order) else None}
        for ladder in example.ladders
    ]
    return field_facts(example.scene, example.runs, example.measures, example.verdicts) | {"convergence": ladders}


def _number(value: float | None) -> str:
    return "not a number" if value is None else f"{value:.6g}"


def comparison_text(result: Comparison, page: Path) -> str:
    """What came of a comparison, line by line: its runs, its worst numbers, its verdicts and its ``page``."""
    runs = [
        f"{run.name}: {run.outcome.status}, {run.outcome.message}" for run in (result.reference, *result.candidates)
    ]
    judged = [
        f"{verdict.word}: {verdict.expectation.of} {verdict.expectation.metric} {verdict.expectation.statistic} at frame "
        f"{verdict.frame} is {verdict.value:.4g} {verdict.unit}, expected {verdict.truth:.4g} within {verdict.within:.4g}"
        + ("" if verdict.error_bar is None else f", known to {verdict.error_bar:.2g}")
        for verdict in result.verdicts
    ]
    asked = {verdict.expectation.of for verdict in result.verdicts}
    unjudged = result.candidates and asked <= {"reference"}
    verdict = f"verdict: {result.word}" + (
        ", of the reference; candidates are measured, not judged" if unjudged else ""
    )
    return "\n".join([*runs, *_known(result), *_worst(result), *judged, verdict, f"page: {page}"])


def _worst(result: Comparison) -> list[str]:
    """A line a candidate: how far it is off where it is worst, in the statistics of the page's first table."""
    lines = []
    for name, measures in result.deviations.items():
        text = [
            f"{' '.join(key).replace('_', ' ')} {measure.values[measure.worst]:.4g} {measure.unit}"
            f" (frame {result.reference.numbers[measure.worst]})"
            for key in TOLD
            if (measure := find(measures, *key)) is not None
        ]
        lines.append(f"{name} at its worst: {', '.join(text)}")
    return lines


def _known(result: Comparison) -> list[str]:
    """Error bars of the reference, a line a statistic; nothing without them."""
    if result.error_bars is None:
        return []
    lines = ["error bars of the reference (its greatest change from rest; the error bar of it, where that is widest):"]
    for measure in result.changes[result.reference.name]:
        bar = result.error_bars.find("change", measure.metric, measure.statistic)
        if bar is not None:
            value = f"{measure.values[measure.worst]:.4g} {measure.unit}"
            lines.append(f"  {measure.metric} {measure.statistic}: {value}, {_bar(result, bar)}")
    lines.append("error bars of deviations from it (the error bar, where that is widest):")
    deviations = [bar for bar in result.error_bars.bars if bar.of == "deviation"]
    return lines + [f"  {bar.metric} {bar.statistic}: {_bar(result, bar)}" for bar in deviations]


def _bar(result: Comparison, bar: ErrorBar) -> str:
    assert result.error_bars is not None  # the bar is of them
    at = f"frame {result.error_bars.numbers[bar.worst]}"
    return f"\N{PLUS-MINUS SIGN} {bar.values[bar.worst]:.2g} {bar.unit} at {at}"


def run_facts(scene: MuscleCase, run: Run) -> dict[str, Any]:
    """What came of a run that nothing was compared with."""
    return {
        "case": scene.name,
        "solver": run.solver,
        "status": run.outcome.status,
        "message": run.outcome.message,
        "verdict": "not judged",
        "cost": {run.name: run.outcome.cost},
        "measures": [],
        "folder": str(run.folder),
    }


def run_text(run: Run) -> str:
    """The same in words."""
    return f"{run.name}: {run.outcome.status}, {run.outcome.message}\nstored in {run.folder}"


def ranking_text(table: Table) -> str:
    """Who stands how on which scene, a line each."""
    lines = []
    for one in table.results:
        found = (one.worst("surface_deviation", "rms"), one.worst("volume", "deviation"))
        text = [
            f"{name} {value[0]:.3g} {unit}"
            for name, unit, value in zip(("surface rms", "volume"), ("mm", "%"), found, strict=True)
            if value is not None
        ]
        if one.seconds_per_frame:
            text.insert(0, f"{1 / one.seconds_per_frame:.3g} frames/s")
        known = " (its error bar)" if one.of_reference and one.measures else ""
        lines.append(f"{one.case}: {one.family}, {one.name}: {one.outcome.status}, {', '.join(text)}{known}")
    return "\n".join([*lines, *(f"{case}: left out, {reason}" for case, reason in table.missing.items())])
