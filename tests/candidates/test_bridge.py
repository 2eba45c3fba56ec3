"""The exchange with solvers of other people: units, poses and attachments; what a candidate leaves out is kept."""

import importlib.util
import json
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import turned_bar

import fem_reference as fr
from candidates import bridge
from fem_reference.scenes.case import Case
from fem_reference.solvers import command

HERE = Path(bridge.__file__).parent
# By candidate: the module that it needs, settings that take seconds, its own law, and how far [mm] (rms) it may be from the minimum
# of this law on its own tetrahedra: twice what was measured once with these settings, and below what the next law is off.
THIRD = {
    "mujoco_flex": ("mujoco", {"steps": 100, "poisson": 0.45}, "st_venant_kirchhoff", 0.01),
    "pypbd_xpbd": ("pypbd", {"steps": 60, "substeps": 20, "poisson": 0.45}, "st_venant_kirchhoff", 0.4),
    "newton_vbd": ("newton", {"steps": 60, "iterations": 20, "poisson": 0.45}, "stable_neo_hooke", 0.2),
    "newton_xpbd": (
        "newton",
        {"steps": 60, "substeps": 32, "iterations": 5, "poisson": 0.45},
        "squared_invariants",
        0.2,
    ),
    "drake_fem": ("drake", {"steps": 60, "substeps": 5, "poisson": 0.45}, "stable_neo_hooke", 0.3),
    "pbat_vbd": ("pbatoolkit", {"steps": 60, "iterations": 20, "poisson": 0.45}, "stable_neo_hooke", 0.2),
    "pbat_xpbd": ("pbatoolkit", {"steps": 60, "substeps": 20, "poisson": 0.45}, "stable_neo_hooke", 0.2),
}


class Follower:
    """A solver that moves what is held, and nothing else."""

    lost = ("3 of 486 tetrahedra",)

    def __init__(self, scene: bridge.Scene, factor: float = 1.0) -> None:
        self.points, self.held, self.factor = scene.points.copy(), scene.held, factor

    def step(self, held, bones) -> None:
        assert set(bones) == {"fixed", "turning"}
        self.points[self.held] = held

    def positions(self):
        return self.points


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return fr.load_case(turned_bar.write(tmp_path_factory.mktemp("bar") / "bar"))


@pytest.fixture
def exported(case, tmp_path) -> Path:
    fr.export_case(case, tmp_path / "scene")
    return tmp_path / "scene"


def test_a_scene_is_read_in_si_units(exported) -> None:
    scene = bridge.read(exported)
    assert np.ptp(scene.points, axis=0) == pytest.approx([0.09, 0.03, 0.03])
    assert (scene.volumes > 0).all()
    assert scene.masses.sum() == pytest.approx(1060 * 0.09 * 0.03 * 0.03)
    assert (scene.mu, scene.bulk) == pytest.approx((1e4, 29e4 / 3))
    # mu and nu = 0.45: E = 2 mu (1 + nu), lambda = 2 mu nu / (1 - 2 nu).
    assert scene.lame(0.49) == pytest.approx((29e3, 9e4, 0.45))
    assert scene.lame(0.3) == pytest.approx((26e3, 15e3, 0.3))
    assert len(scene.boundary()) == 4 * (3 * 3 + 2 * 9 * 3)  # two triangles a square of each face


def test_held_vertices_follow_their_bones_by_rigid_motions(exported) -> None:
    scene = bridge.read(exported)
    assert len(scene.held) == 32
    assert dict(zip(*np.unique(scene.holders, return_counts=True), strict=True)) == {"fixed": 16, "turning": 16}
    half = scene.pose("turning", 0, 20, 0.5)
    assert np.linalg.det(half[:3, :3]) == pytest.approx(1)
    assert np.arccos((np.trace(half[:3, :3]) - 1) / 2) == pytest.approx(0.5)
    solver, kept = Follower(scene), {}
    bridge.drive(solver, scene, 4, lambda frame, points: kept.update({frame: points.copy()}))
    assert sorted(kept) == [0, 10, 20]
    away = scene.points[scene.held] - [0.045, 0, 0.015]
    cosine, sine = np.cos(-1), np.sin(-1)
    turned = np.stack([cosine * away[:, 0] - sine * away[:, 1], sine * away[:, 0] + cosine * away[:, 1], away[:, 2]], 1)
    moves = scene.holders == "turning"
    wanted = np.where(moves[:, None], turned, away) + [0.045, 0, 0.015]
    assert kept[20][scene.held] == pytest.approx(wanted, abs=1e-12)


def test_what_is_left_out_is_printed_and_kept(case, exported, tmp_path, monkeypatch, capsys) -> None:
    said = json.loads((exported / "scene.json").read_text())
    said["effects"] += [{"name": name, "parameters": {}} for name in ("contact", "fibre_passive")]
    said["effects"].append({"name": "neo_hooke", "in": "tendon", "parameters": {}})
    said["attachments"][0]["stiffness"] = 1.0
    (exported / "scene.json").write_text(json.dumps(said))
    out = tmp_path / "out"
    out.mkdir()
    monkeypatch.setattr(sys, "argv", [str(HERE / "newton_vbd" / "x.py"), "--steps", "2", str(exported), str(out)])
    bridge.main(Follower, "numpy")
    missed = ["fibre_passive", "springs of left (held exactly)", "neo_hooke in tendon", "3 of 486 tetrahedra"]
    assert capsys.readouterr().out == f"left out: {', '.join(missed)}\n"
    assert tomllib.loads((out / "candidate.toml").read_text())["left_out"] == missed
    run = fr.read_run(out, case)
    assert run.outcome.message.endswith(f"; left out: {', '.join(missed)}")
    assert run.positions[0] == pytest.approx(run.surface.points, abs=1e-4)  # PLY in single precision
    assert (
        np.abs(run.positions[2] - run.surface.points).max() > 40
    )  # the far corner moves by more than 2 sin(1/2) 45 mm


def test_what_a_candidate_cannot_take_is_refused_with_a_sentence(exported, tmp_path, monkeypatch, capsys) -> None:
    """Another law, and a muscle that only contact moves, for who has none: at rest it would look healthy."""
    said = json.loads((exported / "scene.json").read_text())
    (exported / "scene.json").write_text(json.dumps(said | {"effects": said["effects"][:1]}))
    words = ["--steps", "2", str(exported), str(tmp_path)]
    for refused in ("the scene has neo_hooke; wanted", "no vertex is held by a bone"):
        monkeypatch.setattr(sys, "argv", [str(HERE / "mujoco_flex" / "x.py"), *words])
        with pytest.raises(SystemExit) as ended:
            bridge.main(Follower, "numpy")
        assert ended.value.code == command.REFUSED
        assert capsys.readouterr().out.startswith(refused)
        head = (exported / "attachment_facets.csv").read_text().splitlines()[0]
        (exported / "scene.json").write_text(json.dumps(said | {"attachments": []}))
        (exported / "attachment_facets.csv").write_text(head + "\n")


def test_every_candidate_is_short_and_states_what_it_is() -> None:
    found = sorted(path for path in HERE.glob("*/*.py"))
    assert {*THIRD} <= {path.stem for path in found}
    for path in found:
        text = path.read_text()
        assert len(text.splitlines()) <= 60, path
        assert path.stem == path.parent.name == tomllib.loads((path.parent / "candidate.toml").read_text())["name"]
        for word in ("linear tetrahedra of", "thread", "cannot take", "contact"):
            assert word in text.split('"""')[1], (path, word)


@pytest.mark.slow
@pytest.mark.parametrize("name", THIRD)
def test_a_candidate_reaches_the_minimum_of_its_own_law(name, case, exported, tmp_path) -> None:
    module, settings, law, within = THIRD[name]
    if importlib.util.find_spec(module) is None:
        pytest.skip(f"{module} is not installed: pip install 'fem_reference[{module}]'")
    laws = [{"name": law, "mu": "10 kPa", "lame": "90 kPa"}]
    if law == "squared_invariants":  # without shear stiffness at rest: as weak a law as in the split of errors
        laws.append({"name": "neo_hooke", "mu": "13 Pa"})
    changes = {"effect": laws, "reference.element": "P1"}
    truth = fr.solve(fr.load_case(case.folder, changes), store=tmp_path / "runs")
    words = [word for key, value in settings.items() for word in (f"--{key}", str(value))]
    (tmp_path / "out").mkdir()
    program = [sys.executable, HERE / name / f"{name}.py", *words, exported, tmp_path / "out"]
    subprocess.run(program, check=True, capture_output=True, cwd=HERE / name)
    away = fr.read_run(tmp_path / "out", case).positions[-1] - truth.positions[-1]
    assert np.sqrt((away**2).sum(axis=1).mean()) < within
