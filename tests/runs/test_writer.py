"""Runs while they are written: files that open in ParaView, progress, and runs that were cut off, which continue or begin anew."""

import json
import logging
from pathlib import Path

import numpy as np
import pytest
import small

from fem_reference.problems.problem import AtRest
from fem_reference.runs import store
from fem_reference.runs import writer as writing
from fem_reference.runs.key import versions
from fem_reference.runs.store import Frame, Outcome
from fem_reference.runs.writer import Writer
from fem_reference.scenes import casefile
from fem_reference.solvers.fenicsx.settings import Settings
from fem_reference.studies.execution import Bench
from tests.runs.stored import CUT_OFF, FIBRES, IDENTITY, MESH, SHIFT, SURFACE, begun, store_run, write


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


@pytest.mark.parametrize("status", [None, "crashed"])
def test_a_writer_goes_on_where_a_run_was_cut_off(status: str | None, tmp_path: Path) -> None:
    begun(tmp_path / "run", status=status)
    (tmp_path / "run" / "surface" / ".frame_0010-1.vtp").touch()
    writer = Writer(tmp_path / "run", CUT_OFF | {"name": "other"}, AtRest(SURFACE))
    assert writer.cut_off == writing.CutOff(tmp_path / "run" / "restart", (0, 5))
    writer.add(Frame(5, SURFACE.points + 6, scalars={"energy": 6.0}))  # one that is there already
    assert writer.frames == (0, 5)
    writer.add(Frame(10, SURFACE.points + 10, scalars={"energy": 10.0}))
    writer.close(Outcome("converged", "done"))
    run = store.load(tmp_path / "run")
    assert (run.name, run.numbers, run.scalars["energy"].tolist()) == ("other", (0, 5, 10), [0, 6, 10])
    assert np.array_equal(run.positions[1], SURFACE.points + 6)
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == ["run.json", "surface", "surface.pvd"]
    assert len(list((tmp_path / "run" / "surface").iterdir())) == 3


@pytest.mark.parametrize(
    "change",
    ["converged", "diverged", "no folder", "other frames", "other solver", "other versions", "damaged", "anew"],
)
def test_a_run_that_cannot_go_on_begins_anew(change: str, tmp_path: Path) -> None:
    identity = dict(CUT_OFF)
    begun(tmp_path / "run", status=change if change in ("converged", "diverged") else None)
    assert (tmp_path / "run" / "restart").exists() == (change not in ("converged", "diverged"))
    if change == "no folder":
        writing.clear(tmp_path / "run")
    elif change == "damaged":
        text = (tmp_path / "run" / "run.json").read_text(encoding="utf-8")
        (tmp_path / "run" / "run.json").write_text(text.replace('"energy"', '"energy": 1, "x"'), encoding="utf-8")
    elif change.startswith("other"):
        others = {"frames": (0, 5), "solver": "another", "versions": {"versions": {"numpy": "3"}}}
        key = change.removeprefix("other ")
        identity[{"versions": "origin"}.get(key, key)] = others[key]
    assert Writer(tmp_path / "run", identity, AtRest(SURFACE), anew=change == "anew").frames == ()
    assert not (tmp_path / "run" / "surface").exists()


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


@pytest.mark.parametrize(("number", "kept"), [(11, 3), (10, 2), (2.5, 1), (0, 0)])
def test_frames_from_a_number_on_are_taken_out(number: float, kept: int) -> None:
    state = {"numbers": [0, 5, 10], "residuals": [[], [1.0], [2.0]], "scalars": {"energy": [0.0, 1.0, 2.0]}}
    writing.truncate(state, number)
    assert state["numbers"] == [0, 5, 10][:kept]
    assert state["residuals"] == [[], [1.0], [2.0]][:kept]
    assert state["scalars"] == ({"energy": [0.0, 1.0, 2.0][:kept]} if kept else {})


def test_places_are_those_that_were_stored(tmp_path: Path) -> None:
    surface, tets = writing.places(write(tmp_path / "run"), 5)
    assert np.array_equal(surface, SURFACE.points + SHIFT)
    assert tets is not None
    assert np.array_equal(tets, MESH.points + SHIFT)
    begun(tmp_path / "other")
    assert writing.places(tmp_path / "other", 5)[1] is None


def test_a_stopped_run_is_passed_on_once(tmp_path: Path) -> None:
    """Another run goes on from it; one that is there already stays as it is, and nothing is kept of the stopped one."""
    begun(tmp_path / "stopped", status="stopped")
    writing.pass_on(tmp_path / "stopped", tmp_path / "next")
    assert not (tmp_path / "stopped" / writing.RESTART).exists()
    assert store.status(tmp_path / "next") == "running"
    assert Writer(tmp_path / "next", CUT_OFF, AtRest(SURFACE)).frames == (0, 5)
    begun(tmp_path / "stopped", 1, status="stopped")
    writing.pass_on(tmp_path / "stopped", tmp_path / "next")
    assert Writer(tmp_path / "next", CUT_OFF, AtRest(SURFACE)).frames == (0, 5)
