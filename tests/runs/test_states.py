"""States of the reference: kept by default where they are small, asked for before a run is solved again for ParaView."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapes
import small

import fem_reference as fr
from fem_reference.foundations.mesh import Polylines
from fem_reference.problems.body import ELEMENTS, Cells
from fem_reference.problems.problem import AtRest
from fem_reference.runs import states
from fem_reference.runs.key import versions
from fem_reference.runs.states import NodalState
from fem_reference.runs.store import Frame, Outcome
from fem_reference.runs.writer import Writer
from fem_reference.scenes import casefile
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx import resources
from fem_reference.solvers.fenicsx.settings import Settings
from fem_reference.studies.execution import Bench

SECONDS = 1320.0  # that the stored run took: 22 minutes


def store_run(place: Path, bench: Bench, numbers: tuple[int, ...], kept: tuple[int, ...]) -> None:
    """The run of a reference that does not move, with the states of the frames ``kept``."""
    rest, mesh = bench.setup().surface, shapes.box((2, 2, 4), (10, 10, 40))
    fibres = Polylines(np.column_stack([np.full((8, 2), 5.0), [1, 5, 10, 20, 2, 3, 4, 8]]), [0, 4, 8])
    origin = {"scene": bench.scene.key, "versions": versions()}
    identity = {"name": "reference", "solver": "fenicsx", "frames": numbers, "origin": origin}
    writer = Writer(place, identity, AtRest(rest, fibres, mesh, np.tile([0.0, 0, 1], (len(mesh.tets), 1))))
    state = NodalState(np.zeros((len(mesh.tets), 10, 3)), np.zeros((len(mesh.tets), 4)), np.zeros((0, 0, 3)))
    for number in numbers:
        frame = Frame(number, rest.points, fibres.points, mesh.points)
        writer.add(replace(frame, state=state) if number in kept else frame)
    writer.close(Outcome("converged", "", {"seconds": SECONDS}))


@pytest.mark.parametrize("element", [name for name, (kind, _, _) in ELEMENTS.items() if kind == "tetrahedron"])
def test_the_size_of_states_is_that_of_their_files(element: str, tmp_path: Path) -> None:
    mesh = shapes.box((2, 2, 4), (10, 10, 40))
    cells = Cells(mesh.points, mesh.tets, "tetrahedron", 1, {})
    _, degree, pressure = ELEMENTS[element]
    nodes, pressures = (10 if degree == 2 else 4), {None: 0, 0: 1, 1: 4}[pressure]
    state = NodalState(np.zeros((96, nodes, 3)), np.zeros((96, pressures)), np.zeros((0, 0, 3)))
    states.write(tmp_path, 0, state)
    written = (tmp_path / states.FOLDER / "frame_0000.npz").stat().st_size
    # Beside the arrays a file has four headers of 128 bytes, their names and a directory.
    assert written == pytest.approx(resources.state(cells, element, steps=False), abs=1500)
    states.write(tmp_path, 1, replace(state, before=state.displacement))
    written = (tmp_path / states.FOLDER / "frame_0001.npz").stat().st_size
    assert written == pytest.approx(resources.state(cells, element, steps=True), abs=1500)


@pytest.mark.slow
def test_small_states_are_kept_by_default_and_large_ones_are_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = fr.load_case(small.write(tmp_path / "bar"), {"frames.last": 5, "bone[1].motion.keyframes": KEYFRAMES})
    run = fr.solve(case, store=tmp_path / "runs")
    assert states.are_kept(run.folder, run.numbers)
    size = sum(path.stat().st_size for path in (run.folder / states.FOLDER).glob("frame_*"))
    assert size < resources.MOST_STATES
    monkeypatch.setattr(resources, "MOST_STATES", size / 2)
    run = fr.solve(case, store=tmp_path / "others")
    assert not (run.folder / states.FOLDER).exists()
    # Asked for, they are kept whatever their size; the same run serves both, with what was stored beside it.
    (run.folder / "error_bar.json").write_text(json.dumps({"kept": True}))
    asked = fr.load_case(
        tmp_path / "bar", {"frames.last": 5, "bone[1].motion.keyframes": KEYFRAMES, "reference.store_state": True}
    )
    again = fr.solve(asked, store=tmp_path / "others")
    assert again.folder == run.folder
    assert states.are_kept(again.folder, again.numbers)
    assert np.array_equal(again.positions, run.positions)
    assert json.loads((again.folder / "error_bar.json").read_text()) == {"kept": True}


KEYFRAMES = [{"frame": 0, "angle": "0 rad"}, {"frame": 5, "angle": "0.1 rad"}]


def test_a_run_that_was_cut_off_without_states_does_not_go_on_with_them(tmp_path: Path) -> None:
    scene = casefile.read_muscle(small.write(tmp_path / "bar"))
    bench, place = Bench(scene, tmp_path / "runs"), tmp_path / "runs" / "cut"
    store_run(place, bench, scene.numbers, ())
    facts = json.loads((place / "run.json").read_text())
    (place / "restart").mkdir()
    (place / "run.json").write_text(json.dumps(facts | {"status": "running"}))
    identity = {"name": "reference", "solver": "fenicsx", "frames": scene.numbers}
    origin = {"scene": scene.key, "versions": versions()}
    assert Writer(place, identity | {"origin": origin}, bench.setup().rest).frames == scene.numbers
    origin["settings"] = Settings(store_state=True).model_dump(mode="json")
    assert Writer(place, identity | {"origin": origin}, bench.setup().rest).frames == ()


def test_bodies_carry_no_states_by_default() -> None:
    assert not fenicsx.BodySettings().store_state
