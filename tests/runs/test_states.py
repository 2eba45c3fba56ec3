"""States of the reference: kept by default where they are small, asked for before a run is solved again for ParaView."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapes
import small

import fem_reference as fr
from fem_reference.problems.body import ELEMENTS, Cells
from fem_reference.runs import states
from fem_reference.runs.states import NodalState
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx import resources


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


def test_bodies_carry_no_states_by_default() -> None:
    assert not fenicsx.BodySettings().store_state
