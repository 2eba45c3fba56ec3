"""The run store: what is written reads back, opens in ParaView, appears whole, and a run that was cut off is no result."""

import json
import logging

import numpy as np
import pytest
import shapes

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines
from fem_reference.problems.problem import AtRest
from fem_reference.runs import store
from fem_reference.runs.store import Frame, Outcome
from fem_reference.runs.writer import Writer

SURFACE = shapes.sphere(1, 10.0)
FIBRES = Polylines(np.array([[0.0, 0, -9], [0, 0, 0], [0, 0, 9], [1, 0, -5], [1, 0, 5]]), np.array([0, 3, 5]))
MESH = shapes.box((1, 1, 1), (5, 5, 5))
SHIFT = np.array([0.5, 0, 0])
IDENTITY = {"name": "reference", "solver": "test", "origin": {"case": "none"}, "frames": (0, 5)}


def write(folder, *, close=True):
    writer = Writer(folder, IDENTITY, AtRest(SURFACE, FIBRES, MESH))
    for number in (0, 5):
        shift = np.array([0.1 * number, 0, 0])
        scalars, residuals = {"energy": 2.0 * number}, (1.0, 0.1) if number else ()
        places = SURFACE.points + shift, FIBRES.points + shift, MESH.points + shift
        writer.add(Frame(number, *places, scalars, "well", residuals=residuals))
    if close:
        writer.close(Outcome("converged", "done", {"newton_iterations": 7.0}))
    return folder


def test_what_is_written_reads_back(tmp_path) -> None:
    run = store.load(write(tmp_path / "run"))
    assert (run.name, run.solver, run.numbers) == ("reference", "test", (0, 5))
    assert np.array_equal(run.surface.points, SURFACE.points)
    assert np.array_equal(run.surface.triangles, SURFACE.triangles)
    assert np.array_equal(run.positions[1], SURFACE.points + SHIFT)
    assert np.array_equal(run.fibre_positions[1], FIBRES.points + SHIFT)
    assert run.fibres.offsets.tolist() == [0, 3, 5]
    assert run.scalars["energy"].tolist() == [0, 10]
    assert run.residuals == ((), (1.0, 0.1))
    assert run.outcome == Outcome("converged", "done", run.outcome.cost)
    assert run.outcome.cost["newton_iterations"] == 7
    assert run.outcome.cost["seconds"] > 0


def test_opens_in_paraview(tmp_path) -> None:
    import pyvista

    folder = write(tmp_path / "run")
    for part, points in (("surface", len(SURFACE.points)), ("fibres", len(FIBRES.points)), ("tets", len(MESH.points))):
        reader = pyvista.get_reader(folder / f"{part}.pvd")
        assert reader.time_values == [0, 5]
        reader.set_active_time_value(5)
        block = reader.read()[0]
        assert block.n_points == points
        assert block["displacement"] == pytest.approx(np.tile([0.5, 0, 0], (points, 1)))


def test_progress_is_logged_with_how_far_and_how_long(tmp_path, caplog) -> None:
    caplog.set_level(logging.INFO, logger="fem_reference")
    write(tmp_path / "run")
    assert "reference: frame 0 (1 of 2)" in caplog.text
    assert "frame 5 (2 of 2), well, " in caplog.text


@pytest.mark.parametrize(("quiet", "printed"), [(3600.0, [0, 3]), (0.0, [0, 1, 2, 3])])
def test_progress_is_reported_now_and_then(tmp_path, caplog, monkeypatch, quiet, printed) -> None:
    caplog.set_level(logging.INFO, logger="fem_reference")
    monkeypatch.setattr("fem_reference.runs.writer.QUIET", quiet)
    writer = Writer(tmp_path / "run", IDENTITY | {"frames": (0, 1, 2, 3)}, AtRest(SURFACE))
    for number in range(4):
        writer.add(Frame(number, SURFACE.points))
    assert [number for number in range(4) if f"frame {number} (" in caplog.text] == printed


def test_a_run_that_was_cut_off_is_no_result(tmp_path) -> None:
    folder = write(tmp_path / "run", close=False)
    with pytest.raises(InputError, match='status: got "running", want a run that came to its end'):
        store.load(folder)
    assert store.finished(folder) is None


def test_only_a_converged_run_is_finished(tmp_path) -> None:
    writer = Writer(tmp_path / "run", IDENTITY, AtRest(SURFACE))
    writer.add(Frame(0, SURFACE.points))
    writer.close(Outcome("diverged", "no"))
    assert store.load(tmp_path / "run").outcome.status == "diverged"
    assert store.finished(tmp_path / "run") is None
    assert store.finished(tmp_path / "nothing") is None


def test_damage_is_named(tmp_path) -> None:
    with pytest.raises(InputError, match=r"run\.json: got no file, want the run\.json of a stored run"):
        store.load(tmp_path)
    folder = write(tmp_path / "run")
    state = json.loads((folder / "run.json").read_text())
    (folder / "run.json").write_text(json.dumps(state | {"format": 99}))
    with pytest.raises(InputError, match="format: got 99, want 1"):
        store.load(folder)
    (folder / "run.json").write_text(json.dumps(state | {"numbers": []}))
    with pytest.raises(InputError, match=r"run.numbers: got \[\], want .* at least 1 item"):
        store.load(folder)


def test_writing_again_starts_afresh(tmp_path) -> None:
    folder = write(tmp_path / "run")
    (folder / "surface" / "frame_0099.vtp").write_text("left over")
    write(folder)
    assert not (folder / "surface" / "frame_0099.vtp").exists()


def test_a_run_of_lines_alone_keeps_its_rest_state(tmp_path) -> None:
    writer = Writer(tmp_path / "run", IDENTITY, AtRest(SURFACE, FIBRES, MESH))
    for number in (0, 5):  # straight lines are elsewhere than the fibres from the first frame on
        writer.add(Frame(number, None, FIBRES.points + number + 1))
    writer.close(Outcome("converged", "done"))
    run = store.load(tmp_path / "run")
    assert not run.has_surface
    assert run.positions.shape == (2, len(SURFACE.points), 3)
    assert np.isnan(run.positions).all()
    assert np.array_equal(run.surface.points, SURFACE.points)
    assert np.array_equal(run.fibres.points, FIBRES.points)
    assert run.fibres.offsets.tolist() == [0, 3, 5]
    assert np.array_equal(run.fibre_positions, np.stack([FIBRES.points + 1, FIBRES.points + 6]))
    assert not (tmp_path / "run" / "surface").exists()
    assert (tmp_path / "run" / "fibres.pvd").exists()
    assert store.load(write(tmp_path / "other")).has_surface
