"""Runs that were cut off: they go on from what is stored, or begin anew where they are of something else."""

import json
from pathlib import Path

import numpy as np
import pytest
import small

from fem_reference.problems.problem import AtRest
from fem_reference.runs import cut_off, store
from fem_reference.runs.key import versions
from fem_reference.runs.store import Frame, Outcome
from fem_reference.runs.writer import Writer
from fem_reference.scenes import casefile
from fem_reference.solvers.fenicsx.settings import Settings
from fem_reference.studies.execution import Bench
from tests.runs.stored import CUT_OFF, MESH, SHIFT, SURFACE, begun, store_run, write


@pytest.mark.parametrize("status", [None, "crashed"])
def test_a_writer_goes_on_where_a_run_was_cut_off(status: str | None, tmp_path: Path) -> None:
    begun(tmp_path / "run", status=status)
    (tmp_path / "run" / "surface" / ".frame_0010-1.vtp").touch()
    writer = Writer(tmp_path / "run", CUT_OFF | {"name": "other"}, AtRest(SURFACE))
    assert writer.cut_off == cut_off.CutOff(tmp_path / "run" / "restart", (0, 5))
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
    "change", ["converged", "diverged", "no folder", "other frames", "other solver", "other versions", "damaged"]
)
def test_a_run_that_cannot_go_on_begins_anew(change: str, tmp_path: Path) -> None:
    identity = dict(CUT_OFF)
    begun(tmp_path / "run", status=change if change in ("converged", "diverged") else None)
    assert (tmp_path / "run" / "restart").exists() == (change not in ("converged", "diverged"))
    if change == "no folder":
        cut_off.clear(tmp_path / "run")
    elif change == "damaged":
        text = (tmp_path / "run" / "run.json").read_text(encoding="utf-8")
        (tmp_path / "run" / "run.json").write_text(text.replace('"energy"', '"energy": 1, "x"'), encoding="utf-8")
    elif change.startswith("other"):
        others = {"frames": (0, 5), "solver": "another", "versions": {"versions": {"numpy": "3"}}}
        key = change.removeprefix("other ")
        identity[{"versions": "origin"}.get(key, key)] = others[key]
    assert Writer(tmp_path / "run", identity, AtRest(SURFACE)).frames == ()
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
    cut_off.truncate(state, number)
    assert state["numbers"] == [0, 5, 10][:kept]
    assert state["residuals"] == [[], [1.0], [2.0]][:kept]
    assert state["scalars"] == ({"energy": [0.0, 1.0, 2.0][:kept]} if kept else {})


def test_places_are_those_that_were_stored(tmp_path: Path) -> None:
    surface, tets = cut_off.places(write(tmp_path / "run"), 5)
    assert np.array_equal(surface, SURFACE.points + SHIFT)
    assert tets is not None
    assert np.array_equal(tets, MESH.points + SHIFT)
    begun(tmp_path / "other")
    assert cut_off.places(tmp_path / "other", 5)[1] is None


def test_a_stopped_run_is_passed_on_once(tmp_path: Path) -> None:
    """Another run goes on from it; one that is there already stays as it is, and nothing is kept of the stopped one."""
    begun(tmp_path / "stopped", status="stopped")
    cut_off.pass_on(tmp_path / "stopped", tmp_path / "next")
    assert not (tmp_path / "stopped" / cut_off.FOLDER).exists()
    assert store.status(tmp_path / "next") == "running"
    assert Writer(tmp_path / "next", CUT_OFF, AtRest(SURFACE)).frames == (0, 5)
    begun(tmp_path / "stopped", 1, status="stopped")
    cut_off.pass_on(tmp_path / "stopped", tmp_path / "next")
    assert Writer(tmp_path / "next", CUT_OFF, AtRest(SURFACE)).frames == (0, 5)
