"""Campaigns: a point is the same alone, among workers and after a kill; a worker that dies loses nothing but time."""

import json
import multiprocessing
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import pytest
import small

from fem_reference.foundations.subprocesses import command
from fem_reference.scenes import casefile
from fem_reference.scenes.case import SolverChoice
from fem_reference.studies import cost
from fem_reference.studies.campaign import Workers, carry_out
from fem_reference.studies.variations import Trial

pytestmark = pytest.mark.slow
ONLY = ("pbd",)
PBD = {"sub_iterations": 3, "solver_iterations": 2, "damping": 0.05, "stretch": 1.0, "volume": 1.0, "bending": 0.5}


def scene_in(folder: Path):
    """The small scene without the way back, which takes half the time."""
    path = small.write(folder / "bar") / "case.toml"
    path.write_text(path.read_text().replace("last = 20", "last = 10"))
    return casefile.read_muscle(path.parent)


def die_once(flag: Path, trial: Trial) -> Trial:
    """The trial, but the first process that gets it dies of it."""
    if not flag.exists():
        flag.touch()
        os._exit(9)
    return trial


@dataclass(frozen=True)
class Deadly(Trial):
    """A trial that kills the first worker that it is sent to."""

    flag: Path = Path()

    def __reduce__(self):
        return die_once, (self.flag, Trial(self.scene, self.choice, self.name, self.knob, self.value))


def test_a_worker_that_dies_loses_nothing(tmp_path) -> None:
    scene = scene_in(tmp_path)
    choices = [SolverChoice(solver="pbd", **(PBD | {"sub_iterations": count})) for count in (1, 2, 3)]
    trials = [Trial(scene, choice, "pbd", "sub_iterations", str(i)) for i, choice in enumerate(choices)]
    deadly = Deadly(scene, choices[1], "pbd", "sub_iterations", "1", flag=tmp_path / "died")
    made = carry_out([trials[0], deadly, trials[2]], tmp_path / "runs", Workers(2))
    assert (tmp_path / "died").exists()
    assert [one.run.outcome.status for one in made] == ["converged"] * 3
    alone = carry_out(trials, tmp_path / "alone", Workers())
    for one, other in zip(made, alone, strict=True):
        assert abs(one.run.positions - other.run.positions).max() == 0


def sleep(flag: Path) -> None:
    """What a worker is in that does not end by itself."""
    flag.touch()
    time.sleep(120)


@dataclass(frozen=True)
class Endless(Trial):
    """A trial that the worker that it is sent to sleeps over."""

    flag: Path = Path()

    def __reduce__(self):
        return sleep, (self.flag,)


class StoppedError(Exception):
    """What a signal to stop raises here."""


def test_a_stop_does_not_wait_for_what_workers_are_in(tmp_path) -> None:
    def stop(*_: object) -> None:
        raise StoppedError

    def once_inside() -> None:
        while not (tmp_path / "inside").exists():
            time.sleep(0.05)
        os.kill(os.getpid(), signal.SIGTERM)

    endless = Endless(scene_in(tmp_path), SolverChoice(solver="pbd", **PBD), "pbd", flag=tmp_path / "inside")
    before, begin = signal.signal(signal.SIGTERM, stop), time.monotonic()
    try:
        threading.Thread(target=once_inside, daemon=True).start()
        with pytest.raises(StoppedError):
            carry_out([endless], tmp_path / "runs", Workers(2))
    finally:
        signal.signal(signal.SIGTERM, before)
    assert time.monotonic() - begin < 60, "half of what the worker would sleep"
    assert not multiprocessing.active_children()


def test_bad_settings_are_one_trial_that_failed(tmp_path) -> None:
    scene = scene_in(tmp_path)
    bad = Trial(scene, SolverChoice(solver="pbd", **(PBD | {"stretch": 7.0})), "pbd", "stretch", "7")
    good = Trial(scene, SolverChoice(solver="pbd", **PBD), "pbd")
    for workers in (Workers(), Workers(2)):
        refused, solved = carry_out([bad, good], tmp_path / "runs", workers)
        assert refused.run is None
        assert "stretch" in refused.failure
        assert solved.run is not None


def errors_of(study: cost.Study) -> dict[str, dict[str, float]]:
    return {f"{point.name} {point.label}": point.errors for point in study.points}


def studied_alone(tmp_path: Path, other: str) -> cost.Study:
    """The study by one process; its truth is stored for the study in the folder ``other`` too."""
    alone = cost.study([scene_in(tmp_path)], tmp_path / "alone" / "runs", Workers(), ONLY)
    assert len(errors_of(alone)) > 5
    shutil.copytree(tmp_path / "alone" / "runs", tmp_path / other / "runs", ignore=shutil.ignore_patterns("pbd-*"))
    return alone


@pytest.mark.nightly  # by day the next tests ask workers, one of which dies
def test_a_point_is_the_same_alone_and_with_workers(tmp_path) -> None:
    alone = studied_alone(tmp_path, "two")
    together = cost.study([scene_in(tmp_path)], tmp_path / "two" / "runs", Workers(2), ONLY)
    assert errors_of(together) == errors_of(alone)


@pytest.mark.nightly  # by day tests/contracts/test_survival.py kills a run
def test_a_point_is_the_same_after_a_kill(tmp_path) -> None:
    alone, folder = studied_alone(tmp_path, "cut"), scene_in(tmp_path).folder
    line = command(
        "-m", "fem_reference", "study", str(folder), "--solver", "pbd", "--out", str(tmp_path / "cut"), "--quiet"
    )
    with subprocess.Popen(line, start_new_session=True) as cut_off:
        while not list((tmp_path / "cut" / "runs").glob("pbd-*/run.json")):
            assert cut_off.poll() is None
            time.sleep(0.05)
        os.killpg(cut_off.pid, signal.SIGKILL)
    assert not (tmp_path / "cut" / "bar-pbd" / "study.json").exists()
    subprocess.run(line, check=True, stdout=sys.stderr)
    points = json.loads((tmp_path / "cut" / "bar-pbd" / "study.json").read_text())["points"]
    assert [point["errors"] for point in points] == [point.errors for point in alone.points]


def test_the_workers_of_a_dask_scheduler_make_the_same_runs(tmp_path) -> None:
    distributed = pytest.importorskip("distributed", reason="Dask is not installed: the extra cluster has it")
    scene = scene_in(tmp_path)
    trials = [Trial(scene, SolverChoice(solver="pbd", **(PBD | {"sub_iterations": count})), "pbd") for count in (1, 2)]
    own = {"n_workers": 1, "threads_per_worker": 1, "dashboard_address": None, "silence_logs": 50}
    with distributed.LocalCluster(**own) as cluster:
        made = carry_out(trials, tmp_path / "runs", Workers(1, cluster.scheduler_address))
    alone = carry_out(trials, tmp_path / "alone", Workers())
    for one, other in zip(made, alone, strict=True):
        assert one.run.folder.parent == tmp_path / "runs"
        assert abs(one.run.positions - other.run.positions).max() == 0
