"""The verb ``show``: what a case is made of."""

import argparse
from functools import singledispatch
from pathlib import Path

from fem_reference.cli._choosing import checked_bench, own_candidates, scene_of
from fem_reference.cli._parser import share
from fem_reference.cli._printing import DONE, lines, write_output
from fem_reference.io import files
from fem_reference.problems.muscle import Problem
from fem_reference.problems.scalar import FieldProblem
from fem_reference.report.overview import case_facts

HELP = "what a case is made of; with --out also its meshes for ParaView"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    share(parser, "case", "--set")


def run(options: argparse.Namespace) -> int:
    """Say what a case is made of."""
    scene = scene_of(options)
    bench = checked_bench(scene, options, own_candidates(scene))
    facts = case_facts(scene, bench.setup())
    if options.out is not None:
        built, folder = bench.problem(), options.out / scene.name
        folder.mkdir(parents=True, exist_ok=True)
        _write_meshes(built, folder)
        facts |= {"mesh": built.mesh_facts, "folder": str(folder)}
    write_output(facts, "\n".join(lines(facts)), options)
    return DONE


@singledispatch
def _write_meshes(built: object, folder: Path) -> None:
    """Write what a problem is solved on into ``folder``."""
    raise TypeError(f"{type(built).__name__} has no meshes for {folder}")


@_write_meshes.register
def _(built: Problem, folder: Path) -> None:
    files.write_surface(folder / "surface.vtp", built.surface, built.surface.points)
    files.write_polylines(folder / "fibres.vtp", built.fibres, built.fibres.points)
    files.write_tets(folder / "tets.vtu", built.mesh, built.mesh.points)


@_write_meshes.register
def _(built: FieldProblem, folder: Path) -> None:
    mesh = built.mesh
    files.write_field(folder / "mesh.vtu", mesh.points, mesh.cells, {"fixed": built.fixed[: len(mesh.points)]})
