"""Runs that are cut off go on and end as those that were not; where nothing can be written, nothing is half-written."""

from pathlib import Path
from typing import Any

import kills
import pytest
import shapes
import small

from fem_reference.runs import cut_off
from fem_reference.runs.store import Frame, Run, Writer
from fem_reference.scenes import casefile
from fem_reference.studies.execution import Bench

SURFACE = shapes.sphere(1, 10.0)
IDENTITY = {"name": "one", "solver": "test", "origin": {"versions": {"numpy": "2"}}, "frames": (0, 5, 10)}
MOVING = """
[[effect]]
name = "inertia"
density = "1000 kg/m^3"

[[effect]]
name = "viscosity"
eta = "10 Pa s"

[[effect]]
name = "contact"
stiffness = "1 MPa/mm"
smoothing = "0.5 mm"

[fibres]
"""


class CutError(Exception):
    """What ends a run in the middle."""


def cut_after(monkeypatch: pytest.MonkeyPatch, frames: int) -> None:
    """From now on, whoever stores that many frames of a run is cut off."""
    add = Writer.add

    def until(self: Writer, frame: Frame) -> None:
        add(self, frame)
        if len(self.frames) == frames:
            raise CutError

    monkeypatch.setattr(Writer, "add", until)


def solved(scene: Path, runs: Path, changes: dict[str, Any]) -> Run:
    bench = Bench(casefile.read(scene, changes=changes), runs)
    return bench.obtain("reference", bench.scene.reference, "reference")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["at rest again", "with old factorisations", "with inertia and contact"])
def test_a_run_that_was_cut_off_goes_on(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a load comes back, where an old factorisation serves on, and where velocities and contact are remembered."""
    scene = small.write(tmp_path / "bar")
    changes: dict[str, Any] = {"reference.first_step": 2.5, "frames.every": 4}
    if kind == "with old factorisations":
        text = (scene / "case.toml").read_text(encoding="utf-8")
        (scene / "case.toml").write_text(text.replace("first_step = 5", 'first_step = 5\nlinear_solver = "lagged"'))
    if kind == "with inertia and contact":
        text = (scene / "case.toml").read_text(encoding="utf-8").replace("[fibres]", MOVING)
        (scene / "case.toml").write_text(text.replace("every = 5", 'every = 5\ninterval = "2 ms"'))
    whole = solved(scene, tmp_path / "whole", changes)
    assert whole.outcome.status == "converged", whole.outcome.message
    for frames in (2, 5):
        with monkeypatch.context() as patch:
            cut_after(patch, frames)
            with pytest.raises(CutError):
                solved(scene, tmp_path / "cut", changes)
    begun: list[int] = []
    monkeypatch.setattr(Writer, "_log_progress", lambda _self, frame: begun.append(frame.number))
    ended = solved(scene, tmp_path / "cut", changes)
    assert begun == [20]  # what was stored was not solved again
    assert kills.differences(whole, ended) == []
    for name in ("newton_iterations", "load_steps", "cut_backs"):
        assert ended.outcome.cost[name] == whole.outcome.cost[name]
    assert not (ended.folder / cut_off.FOLDER).exists()  # type: ignore[operator]
