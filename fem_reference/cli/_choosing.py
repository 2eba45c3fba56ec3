"""Choices of the command line: a scene, candidates of it, and the bench that they are solved on."""

import argparse
from pathlib import Path
from typing import Any

from fem_reference.assessment import judge
from fem_reference.cli._printing import out
from fem_reference.foundations.errors import InputError
from fem_reference.problems import of_case
from fem_reference.scenes import casefile
from fem_reference.scenes.case import Candidate, Case
from fem_reference.solvers import recorded
from fem_reference.studies.execution import Bench


def scene_of(options: argparse.Namespace) -> Case:
    """The scene of the case, with what ``--set`` changes of it and the effects that it needs."""
    return of_case.chosen(casefile.read(options.case, changes=dict(map(casefile.setting, options.set))))


def own_candidates(scene: Case) -> list[tuple[Candidate, str]]:
    """The candidates of the scene, each with its place."""
    return [(candidate, f"candidate[{i}]") for i, candidate in enumerate(scene.candidate)]


def choose(scene: Case, text: str, unit: str | None) -> tuple[Candidate, str]:
    """The candidate of the scene with this name, else the recorded frames in this folder; and the place that chooses it."""
    names = [candidate.name for candidate in scene.candidate]
    if text in names:
        if Path(text).is_dir():
            raise InputError(
                "--candidate", f'"{text}", a candidate of the case and a folder', f"another name, or ./{text}"
            )
        return scene.candidate[names.index(text)], f"candidate[{names.index(text)}]"
    if not text or not Path(text).exists():
        raise InputError("--candidate", f'"{text}"', f"a folder of frames, or one of {', '.join(names)}")
    return recorded.choice(Path(text), unit, "--candidate"), "--candidate"


def check_names(names: list[str]) -> None:
    """InputError where two candidates have one name, or one has that of the reference."""
    for name in names:
        if name == "reference":
            raise InputError("--candidate", '"reference"', "another name: this is what candidates are measured against")
        if names.count(name) > 1:
            raise InputError("--candidate", f'"{name}" twice', "folders and candidates of different names")


def refuse_error_bar(scene: Case, options: argparse.Namespace) -> None:
    """InputError where error bars are wanted of what has none."""
    if options.error_bar:
        casefile.muscle(scene, "--error-bar")


def checked_bench(scene: Case, options: argparse.Namespace, chosen: list[tuple[Candidate, str]]) -> Bench[Any]:
    """The bench of a scene whose expectations, reference and ``chosen`` candidates can all be read."""
    judge.check(scene)
    bench: Bench[Any] = Bench(scene, out(options) / "runs", options.ranks)
    for choice, place in [(scene.reference, "reference"), *chosen]:
        bench.settings(choice, place)
    return bench
