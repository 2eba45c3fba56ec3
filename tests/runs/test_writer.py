"""Runs while they are written: files that open in ParaView, progress, and what stays where a file cannot be written."""

import logging
from pathlib import Path

import numpy as np
import pytest

from fem_reference.problems.problem import AtRest
from fem_reference.runs import store
from fem_reference.runs.store import Frame, Outcome
from fem_reference.runs.writer import Writer
from tests.runs.stored import CUT_OFF, FIBRES, IDENTITY, MESH, SURFACE, begun, write


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


def test_a_run_whose_folder_cannot_be_written_into_any_more_keeps_what_it_has(tmp_path: Path) -> None:
    writer = begun(tmp_path / "run")
    surfaces = (tmp_path / "run" / "surface").rename(tmp_path / "kept")
    (tmp_path / "run" / "surface").touch()  # no folder any more
    with pytest.raises(OSError, match="surface"):
        writer.add(Frame(10, SURFACE.points + 10, scalars={"energy": 10.0}))
    (tmp_path / "run" / "surface").unlink()
    surfaces.rename(tmp_path / "run" / "surface")
    assert Writer(tmp_path / "run", CUT_OFF, AtRest(SURFACE)).frames == (0, 5)
    assert len(list((tmp_path / "run" / "surface").iterdir())) == 2
