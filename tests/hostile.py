"""Files that anybody may have written, by kind: made whole, and what reads them once ``damage`` has been at them."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import hostile_lines
import hostile_runs as runs
import meshio
import numpy as np
from hostile_runs import BALL, FIBRE, shipped

from fem_reference.foundations import formula, units
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import check_closed, check_finite
from fem_reference.io import files
from fem_reference.io.formats import formats
from fem_reference.problems import anatomy, muscle, scalar
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase, Outline
from fem_reference.studies.execution import Bench


@dataclass(frozen=True)
class Kind:
    """A kind of input: a folder made once, the files in it that are damaged, and how the folder is read."""

    make: Callable[[Path], None]
    damaged: str
    read: Callable[[Path], object]


def read_scene(folder: Path) -> None:
    """The scene in a folder, with the settings that it chooses and what is read before anything is solved."""
    scene = casefile.read(folder)
    bench: Bench[Any] = Bench(scene, folder / "runs")
    for choice, place in ((scene.reference, "reference"), *((entry, "candidate") for entry in scene.candidate)):
        bench.settings(choice, place)
    assert len(scene.key) == 64
    scene._repr_html_()
    muscle.setup(scene) if isinstance(scene, MuscleCase) else scalar.build(scene)


def _make_choices(folder: Path) -> None:
    (folder / "changes.json").write_text(
        json.dumps({"effect[0].mu": "10 kPa", "muscle.tet_size": "20 mm", "frames.last": 300})
    )


def read_changes(folder: Path) -> None:
    """Keys and values, as of the command line, for a shipped scene."""
    text = (folder / "changes.json").read_text(encoding="utf-8", errors="replace")
    try:
        changes = json.loads(text)
    except (ValueError, RecursionError):
        changes = None
    if not isinstance(changes, dict):
        casefile.read("box_squeeze", changes=dict([casefile.setting(text[:2000])]))
        return
    casefile.read("box_squeeze", changes=changes)


def _make_words(folder: Path) -> None:
    words = ["30 kPa", "1, 2, 3 mm", "sin(pi*x) + 2", "9.81 m/s^2", "5 %"]
    (folder / "words.json").write_text(json.dumps({str(i): word for i, word in enumerate(words)}))


def read_words(folder: Path) -> None:
    """Texts as quantities and formulas."""
    text = (folder / "words.json").read_text(encoding="utf-8", errors="replace")
    try:
        words = json.loads(text)
        words = list(words.values()) if isinstance(words, dict) else [text]
    except (ValueError, RecursionError):
        words = [text]
    for word in words:
        for kind in units.KINDS:
            _valued(units.quantity, word, kind)
        _valued(units.three, word, "a length")
        _valued(units.length_unit, word)
        checked = _valued(formula._checked, word)
        if checked is not None:
            _finite(checked)


def _valued(reader: Callable[..., Any], *given: Any) -> Any:
    """What a reader of a value makes of it; None where it refuses, as records expect, by a ValueError."""
    try:
        return reader(*given)
    except ValueError:
        return None


def _finite(text: str) -> None:
    scalar._try(text, np.linspace(0, 1, 12).reshape(4, 3), "formula")


# Meshes


def _make_surface(suffix: str, **settings: Any) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        if settings or formats()[suffix].write is None:
            mesh = meshio.Mesh(BALL.points, [("triangle", BALL.triangles)])
            mesh.write(folder / f"ball{suffix}", **settings)
        else:
            files.write_surface(folder / f"ball{suffix}", BALL, BALL.points)

    return make


def read_surface(folder: Path) -> None:
    """A closed surface."""
    (path,) = folder.iterdir()
    surface = files.read_surface(path, 1.0)
    (check_closed if files.shares_points(str(path)) else check_finite)(surface)


def _make_lines(suffix: str) -> Callable[[Path], None]:
    return lambda folder: files.write_polylines(folder / f"lines{suffix}", FIBRE, FIBRE.points)


def read_lines(folder: Path) -> None:
    """Polylines."""
    (path,) = folder.iterdir()
    files.read_polylines(path, 1.0)


# Tables


def _make_tables(folder: Path) -> None:
    (folder / "ends.csv").write_text("vertex,value\n" + "".join(f"{i},{i % 3}\n" for i in range(30)))
    rows = [f"a,{i},{x},{y},{z}" for i, (x, y, z) in enumerate((BALL.points[:5] * 1.01).tolist())]
    (folder / "landmarks.csv").write_text("\n".join(["cloud,landmark,x,y,z", *rows, ""]))


def read_tables(folder: Path) -> None:
    """Vertices of an attachment, and the landmarks around one, laid on a bone."""
    anatomy._listed(folder / "ends.csv", SimpleNamespace(value=2), len(BALL.points))  # type: ignore[arg-type]
    outline = Outline(file="landmarks.csv", unit="mm", clouds=("a",), reach="5 mm")  # type: ignore[arg-type]
    anatomy.draped(anatomy._patches(folder / "landmarks.csv", outline, "case.toml"), BALL)


def _meshes() -> dict[str, Kind]:
    made: dict[str, Callable[[Path], None]] = {
        suffix: _make_surface(suffix) for suffix in formats() if suffix != ".msh"
    }
    made |= {"binary.ply": _make_surface(".ply", binary=True), "binary.stl": _make_surface(".stl", binary=True)}
    made |= {"meshio.vtu": _make_surface(".vtu", binary=True), "text.vtu": _make_surface(".vtu", binary=False)}
    made |= {
        "text.vtk": _make_surface(".vtk", binary=False),
        ".msh": _make_surface(".msh", file_format="gmsh"),
        "old.msh": _make_surface(".msh", file_format="gmsh22", binary=False),
    }
    found = {f"surface {name}": Kind(make, "ball*", read_surface) for name, make in made.items()}
    return found | {f"lines {suffix}": Kind(_make_lines(suffix), "lines*", read_lines) for suffix in (".vtk", ".vtp")}


KINDS: dict[str, Kind] = {
    **{
        f"scene {name}": Kind(shipped(name), "case.toml", read_scene)
        for name in ("box_squeeze", "rod", "surface_figure")
    },
    "tables of a scene": Kind(shipped("plate_square"), "*.csv", read_scene),
    "changes": Kind(_make_choices, "changes.json", read_changes),
    "quantities and formulas": Kind(_make_words, "words.json", read_words),
    **_meshes(),
    "candidate": Kind(runs.make_sequence, "*", runs.read_sequence),
    "candidate.toml": Kind(runs.make_sequence, "candidate.toml", runs.read_sequence),
    "candidate, pvd": Kind(runs.make_index, "frames.pvd", runs.read_sequence),
    "candidate, xdmf": Kind(runs.make_series("XML"), "run.xdmf", runs.read_sequence),
    "candidate, xdmf and hdf5": Kind(runs.make_series("HDF"), "run.*", runs.read_sequence),
    "baseline": Kind(runs.make_baseline, "ball.json", runs.read_baseline),
    "run.json": Kind(runs.make_run, "run/run.json", runs.read_run),
    "arrays of a run": Kind(runs.make_run, "run/s*/*", runs.read_run),
    "fibres of a run": Kind(runs.make_run, "run/fibres/*", runs.read_run),
    "field of a run": Kind(runs.make_field, "runs/*/field/*.npz", runs.read_field),
    "error bars": Kind(runs.make_bars, "*.json", runs.read_bars),
    "study": Kind(runs.make_study, "study.json", runs.read_study),
    "scene of lines": Kind(hostile_lines.make_lines, "case.toml", read_scene),
    "lines of a scene": Kind(hostile_lines.make_lines, "case.toml", hostile_lines.read_lines),
    "fibres of a template": Kind(hostile_lines.make_template, "case.toml", hostile_lines.read_fibres),
    "fibres of heads": Kind(hostile_lines.make_heads, "case.toml", hostile_lines.read_fibres),
    "files of heads": Kind(hostile_lines.make_heads, "*.vt[pk]", hostile_lines.read_fibres),
    "attachments": Kind(_make_tables, "*.csv", read_tables),
}
REFUSED = InputError
