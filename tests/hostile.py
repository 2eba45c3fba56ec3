"""Files that anybody may have written, damaged at random: what reads them, and how they are damaged."""

import copy
import json
import math
import re
import tomllib
from collections.abc import Callable
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import meshio
import numpy as np
import shapes
from hypothesis import strategies as st

from fem_reference.assessment import baseline, cost_study, error_bars, regression
from fem_reference.assessment.measured import CurrentMeasures
from fem_reference.foundations import formula, units
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines, check_closed, check_finite
from fem_reference.foundations.records import parse
from fem_reference.io import files
from fem_reference.io.formats import formats
from fem_reference.problems import anatomy, muscle, scalar
from fem_reference.problems.problem import AtRest
from fem_reference.problems.setup import Setup
from fem_reference.runs import results, states, store
from fem_reference.runs.states import NodalState
from fem_reference.runs.store import Frame, Outcome, Run
from fem_reference.runs.writer import Writer
from fem_reference.scenes import casefile
from fem_reference.scenes.case import HOME
from fem_reference.scenes.muscle import MuscleCase, Outline
from fem_reference.solvers import recorded
from fem_reference.studies.execution import Bench

BALL = shapes.sphere(1, 30.0)
FIBRE = Polylines(np.array([[0.0, 0, -15], [0, 0, 0], [0, 0, 15]]), np.array([0, 3]))
NUMBERS = (0, 10, 20)
SETUP = Setup(BALL, (), (), NUMBERS, None)
BALL_SCENE = SimpleNamespace(name="ball", key="0123456789abcdef0123", place="case.toml", numbers=NUMBERS)
# What no sensible file has.
NASTY: list[Any] = [0, -1, 1, 2**31, 2**63, 2**64, -(2**63) - 1, 10**400, "9" * 5000]
NASTY += [0.0, -0.0, 1e-320, 1e300, -1e300, math.inf, math.nan, True, None, "", " ", ".", ".."]
NASTY += ["x" * 5000, "\0", "\x1b[31m", "a\nb", "<script>alert(1)</script>", "&amp;", "\u202e", "\ud800"]
NASTY += ["../../../../etc/passwd", "/etc/passwd", "data:../x", "mesh:../../x", "nan", "1e999", "1 mm"]
NASTY += ["1 mm^9^9^9", "-1 kPa", "1e300 kPa", "1e-300 mm", "9**9**9", "1 " + "(" * 90, "2 kPa kPa"]
NASTY += ["1 mm" * 30, "0, 0, 0 mm", "nan, 0, 0 mm", "1e9 mm", "x**x**x", "1/0", "(" * 300, "%", "1 %"]
NASTY += [[], {}, [[]], [0] * 1000, {"a": {"b": {"c": 1}}}, [None], ["x"], [[0, 1], [2]], "fenicsx", "pbd"]
NUMBERS_IN_TEXT = [b"0", b"-1", b"3", b"1e300", b"nan", b"inf", b"1e-320", b"", b"1e9", b"0x10", b"1_0", b"x"]
NUMBERS_IN_TEXT += [b"4294967295", b"18446744073709551615", b"99999999999999999999", b"9" * 5000, b"-4294967296"]
NUMBERS_IN_TEXT += [b"2147483648", b"1000000"]
# What no sensible text has.
PIECES = [b"", b"\xff" * 8, b"[" * 5000, b"a." * 3000 + b"a=1\n"]


@dataclass(frozen=True)
class Kind:
    """A kind of input: a folder made once, the files in it that are damaged, and how the folder is read."""

    make: Callable[[Path], None]
    damaged: str
    read: Callable[[Path], object]


def damage(data: bytes) -> st.SearchStrategy[bytes]:
    """The bytes of a file, damaged: as bytes, or, where it is one, as a text of numbers, or as a tree of tables and lists."""
    kinds = [_bytes(data), _bytes(data)]
    if re.search(rb"\d", data):
        kinds += [_numbers(data), _numbers(data)]
    for read, write in ((json.loads, _as_json), (tomllib.loads, _as_toml)):
        try:
            tree = read(data.decode())
        except ValueError:
            continue
        if isinstance(tree, dict):
            kinds += [_tree(tree).map(write)] * 6
    return st.one_of(*kinds)


@st.composite
def _bytes(draw: Any, data: bytes) -> bytes:
    for _ in range(draw(st.integers(1, 3))):
        start = draw(st.integers(0, len(data)))
        stop = min(len(data), start + draw(st.sampled_from([0, 1, 2, 8, 64, 10**6])))
        piece = draw(
            st.sampled_from(
                [b"", data[start:stop] * 2, b"\0" * (stop - start), b"\xff" * 8, b"[" * 5000, b"a." * 3000 + b"a=1\n"]
            )
        )
        data = data[:start] + draw(st.one_of(st.just(piece), st.binary(max_size=12))) + data[stop:]
    return data


@st.composite
def _numbers(draw: Any, data: bytes) -> bytes:
    for _ in range(draw(st.integers(1, 3))):
        found = list(re.finditer(rb"(?<![A-Za-z_])[-+]?\d[\d.]*(?:e[-+]?\d+)?", data))[:5000]
        if found:
            one = found[draw(st.integers(0, len(found) - 1))]
            data = data[: one.start()] + draw(st.sampled_from(NUMBERS_IN_TEXT)) + data[one.end() :]
    return data


@st.composite
def _tree(draw: Any, tree: Any) -> Any:
    tree = json.loads(json.dumps(tree))
    for _ in range(draw(st.integers(1, 2))):
        inside: Any = tree
        while True:
            keys = list(inside) if isinstance(inside, dict) else list(range(len(inside)))
            if not keys:
                break
            key = draw(st.sampled_from(keys))
            if isinstance(inside[key], dict | list) and inside[key] and draw(st.integers(0, 4)):
                inside = inside[key]
                continue
            _change(draw, inside, key)
            break
    return tree


def _change(draw: Any, inside: Any, key: Any) -> None:
    what = draw(st.sampled_from(["set", "set", "set", "set", "scale", "delete", "add", "copy"]))
    value = copy.deepcopy(draw(st.sampled_from(NASTY)))  # which the next change may change
    if what == "delete":
        del inside[key]
    elif what == "add" and isinstance(inside, dict):
        inside[draw(st.sampled_from(["x", "", "name", "folder", "place", "a.b", "from_file", "surface"]))] = value
    elif what == "copy" and isinstance(inside, list):
        inside.append(inside[key])
    elif what == "scale" and isinstance(inside[key], int | float):
        inside[key] *= draw(st.sampled_from([-1, 0, 2, 1e6, 1e-6]))
    else:
        inside[key] = value


def _as_json(tree: Any) -> bytes:
    return json.dumps(tree).encode("utf-8", "surrogatepass")


def _as_toml(tree: Any) -> bytes:
    return "".join(f"{json.dumps(key)} = {_toml(value)}\n" for key, value in tree.items()).encode(
        "utf-8", "surrogatepass"
    )


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {_toml(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return json.dumps("" if value is None else value, ensure_ascii=False)


# Scenes


def _shipped(name: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        for file in (HOME / "cases" / name).iterdir():
            if file.is_file():
                (folder / file.name).write_bytes(file.read_bytes())

    return make


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


# Candidates


def moved(number: int) -> Any:
    """The ball, wandering."""
    return BALL.points + [number / 10, 0, 0]


def run(name: str, positions: Any) -> Run:
    """A run of the ball."""
    inside = np.stack([FIBRE.points + [number / 10, 0, 0] for number in NUMBERS])
    return Run(name, "test", Outcome("converged", "done"), NUMBERS, BALL, np.asarray(positions), FIBRE, inside)


REFERENCE = run("reference", [moved(number) for number in NUMBERS])


def _make_sequence(folder: Path) -> None:
    for number in NUMBERS:
        files.write_surface(folder / f"frame_{number}.ply", BALL, moved(number))
    (folder / "candidate.toml").write_text(
        'name = "mine"\nversion = "1.2"\nunit = "mm"\nseconds_per_frame = 0.5\nthreads = 2\n'
    )


def _make_index(folder: Path) -> None:
    (folder / "below").mkdir()
    for number in NUMBERS:
        files.write_surface(folder / "below" / f"frame_{number}.vtp", BALL, moved(number))
    files.write_pvd(folder / "frames.pvd", [(number, f"below/frame_{number}.vtp") for number in NUMBERS])


def _make_series(data_format: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        # Meshio puts its .h5 where the process is.
        with chdir(folder), meshio.xdmf.TimeSeriesWriter(folder / "run.xdmf", data_format=data_format) as series:
            series.write_points_cells(BALL.points, [("triangle", BALL.triangles)])
            for number in NUMBERS:
                series.write_data(number, point_data={"displacement": moved(number) - BALL.points})

    return make


def read_sequence(folder: Path) -> None:
    """A candidate; where it is read, only what is where it was passes its baseline."""
    taken: list[Frame] = []
    settings = parse(recorded.RecordedSettings, {"folder": str(folder), "unit": "mm"}, "case.toml")
    recorded.choice(folder)
    recorded.solve(SETUP, settings, taken.append)
    candidate = run("mine", [frame.surface for frame in taken])
    assert np.isfinite(candidate.positions).all()
    folder = folder.parent
    past = CurrentMeasures.of(BALL_SCENE, SETUP, run("mine", REFERENCE.positions), REFERENCE)  # type: ignore[arg-type]
    baseline.update(folder / "ball.json", past)
    word = _checked(folder / "ball.json", candidate)
    away = np.abs(candidate.positions - REFERENCE.positions).max()
    assert word != "pass" or away <= 2 * baseline.MOVED, f"a false pass, {away} mm away"


def _checked(path: Path, candidate: Run) -> str:
    now = CurrentMeasures.of(BALL_SCENE, SETUP, candidate, REFERENCE)  # type: ignore[arg-type]
    return str(regression.check(baseline.read(path, BALL_SCENE, "mine"), now).word)  # type: ignore[arg-type]


def _make_baseline(folder: Path) -> None:
    past = CurrentMeasures.of(BALL_SCENE, SETUP, run("mine", REFERENCE.positions), REFERENCE)  # type: ignore[arg-type]
    baseline.update(folder / "ball.json", past)


def read_baseline(folder: Path) -> None:
    """A baseline, by which a candidate that has no numbers in a frame never passes."""
    path, positions = folder / "ball.json", np.array(REFERENCE.positions)
    _checked(path, run("mine", positions))
    positions[1] = np.nan
    assert _checked(path, run("mine", positions)) != "pass", "a false pass of what is not a number"


# Stored runs


def _make_run(folder: Path) -> None:
    identity = {
        "name": "reference",
        "solver": "test",
        "origin": {"case": "none", "versions": {"numpy": "2"}},
        "frames": NUMBERS,
    }
    writer = Writer(folder / "run", identity, AtRest(BALL, FIBRE, shapes.box((1, 1, 1), (5, 5, 5))))
    for number in NUMBERS:
        tets = writer.rest.mesh.points + number  # type: ignore[union-attr]
        state = NodalState(np.zeros((6, 10, 3)) + number, np.zeros((6, 4)), np.zeros((0, 0, 3)))
        writer.add(Frame(number, moved(number), FIBRE.points, tets, {"energy": 1.0 * number}, state=state))
    writer.close(Outcome("converged", "done", {"newton_iterations": 7.0}))


def read_run(folder: Path) -> None:
    """A stored run, with its states."""
    store.status(folder / "run")
    store.finished(folder / "run")
    found = store.load(folder / "run")
    found._repr_html_()
    recorded.solve(SETUP, recorded.RecordedSettings(folder=str(folder / "run"), unit="mm"), lambda _frame: None)
    mesh, fibre = states.read_rest(folder / "run")
    known = results.Results(mesh, (), states.StoredStates(folder / "run", found.numbers), fibre)
    for number in found.numbers:
        known.evaluate([[1.0, 1.0, 1.0]], number)


def _make_field(folder: Path) -> None:
    _shipped("rod")(folder)
    run = Bench(casefile.read(folder), folder / "runs")
    run.obtain("reference", run.scene.reference, "reference")


def read_field(folder: Path) -> None:
    """A stored run of a field."""
    (path,) = (folder / "runs").glob("scikit_fem-*")
    found = store.load(path)
    found._repr_html_()
    assert found.values.shape[0] == len(found.numbers)
    assert found.vertex_values.shape[1] == len(found.points)


def _make_bars(folder: Path) -> None:
    one = error_bars.ErrorBar("deviation", "surface_deviation", "rms", "mm", np.array([0.0, 1, 2]), {"mesh": 1.0})
    error_bars.save(error_bars.ErrorBars(NUMBERS, (4.0, 8.0), 1.5, (one,)), folder, {"reference": "x"})


def read_bars(folder: Path) -> None:
    """Stored error bars."""
    error_bars.load(folder, {"reference": "x"})


def _make_study(folder: Path) -> None:
    like = dict.fromkeys(cost_study.FEATURES, 1.0)
    case = cost_study.CaseStudy("ball", "A ball", "closed form", (), {"a.b": "mm"}, {"a.b": 0.1}, (), 320, 2.0, like)
    (folder / "study.json").write_text(json.dumps(cost_study.facts(case, {"machine": "x"})))


def read_study(folder: Path) -> None:
    """A stored study."""
    cost_study.load(folder / "study.json")


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
    made: dict[str, Callable[[Path], None]] = {suffix: _make_surface(suffix) for suffix in files.surface_suffixes()}
    made |= {"binary.ply": _make_surface(".ply", binary=True), "binary.stl": _make_surface(".stl", binary=True)}
    made |= {"meshio.vtu": _make_surface(".vtu", binary=True), "text.vtu": _make_surface(".vtu", binary=False)}
    made |= {
        "text.vtk": _make_surface(".vtk", binary=False),
        "old.msh": _make_surface(".msh", file_format="gmsh22", binary=False),
    }
    found = {f"surface {name}": Kind(make, "ball*", read_surface) for name, make in made.items()}
    return found | {f"lines {suffix}": Kind(_make_lines(suffix), "lines*", read_lines) for suffix in (".vtk", ".vtp")}


KINDS: dict[str, Kind] = {
    **{
        f"scene {name}": Kind(_shipped(name), "case.toml", read_scene)
        for name in ("box_squeeze", "rod", "surface_figure")
    },
    "tables of a scene": Kind(_shipped("plate_square"), "*.csv", read_scene),
    "changes": Kind(_make_choices, "changes.json", read_changes),
    "quantities and formulas": Kind(_make_words, "words.json", read_words),
    **_meshes(),
    "candidate": Kind(_make_sequence, "*", read_sequence),
    "candidate.toml": Kind(_make_sequence, "candidate.toml", read_sequence),
    "candidate, pvd": Kind(_make_index, "frames.pvd", read_sequence),
    "candidate, xdmf": Kind(_make_series("XML"), "run.xdmf", read_sequence),
    "candidate, xdmf and hdf5": Kind(_make_series("HDF"), "run.*", read_sequence),
    "baseline": Kind(_make_baseline, "ball.json", read_baseline),
    "run.json": Kind(_make_run, "run/run.json", read_run),
    "arrays of a run": Kind(_make_run, "run/s*/*", read_run),
    "fibres of a run": Kind(_make_run, "run/fibres/*", read_run),
    "field of a run": Kind(_make_field, "runs/*/field/*.npz", read_field),
    "error bars": Kind(_make_bars, "*.json", read_bars),
    "study": Kind(_make_study, "study.json", read_study),
    "attachments": Kind(_make_tables, "*.csv", read_tables),
}
REFUSED = InputError
