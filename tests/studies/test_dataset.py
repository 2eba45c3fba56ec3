"""A data set to learn from: only checked states, splits that share nothing, hashes of whole files, and the same after a kill."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
import shapes

from fem_reference.assessment import second_check
from fem_reference.foundations.errors import InputError
from fem_reference.solvers import fenicsx
from fem_reference.studies import dataset, dataset_loader, refinement
from fem_reference.studies.campaign import Workers
from fem_reference.studies.dataset import Sizes
from fem_reference.studies.execution import Bench

SMALL = Sizes(2, 2, shipped=())


def frames(angles, points=None, triangles=None) -> dict:
    """A scene whose bone turns about z by ``angles`` [rad], of a muscle that is a box."""
    poses = np.tile(np.eye(4), (len(angles), 1, 1, 1))
    poses[:, 0, 0, 0] = poses[:, 0, 1, 1] = np.cos(angles)
    poses[:, 0, 1, 0] = np.sin(angles)
    poses[:, 0, 0, 1] = -np.sin(angles)
    skin = shapes.skin(shapes.box((2, 2, 4), (1.0, 1.0, 3.0)))
    return {
        "frames": np.arange(len(angles)),
        "poses": poses,
        "activation": np.zeros(len(angles)),
        "points": skin.points if points is None else points,
        "triangles": skin.triangles if triangles is None else triangles,
    }


def test_the_way_back_is_in_the_part_of_the_way_there() -> None:
    angles = np.concatenate([np.linspace(0, 1, 11), np.linspace(0.9, 0, 10)])
    found = dataset.splits({"there_and_back": frames(angles)}, seed=1)["pose"]
    train, test = (found[part]["there_and_back"] for part in ("train", "test"))
    assert sorted(train + test) == list(range(21))
    assert test
    assert not {20 - row for row in test} & {*train}
    assert {0, 20} <= {*train}, "rest is known to everybody"


def test_an_activation_makes_another_pose() -> None:
    scene = frames(np.zeros(9)) | {"activation": np.linspace(0, 1, 9)}
    assert len(dataset.splits({"active": scene}, seed=1)["pose"]["test"]["active"]) == 2


def test_one_shape_is_never_in_both_parts() -> None:
    """A box that is moved, turned, or in other triangles is the same shape; one of other sides is not."""
    fine, box = shapes.skin(shapes.box((4, 4, 8), (1.0, 1.0, 3.0))), frames([0.0])
    turned = box["points"][:, [1, 2, 0]] + 5.0  # an even permutation: a rotation
    found = {"box": box, "turned": frames([0.0], turned), "fine": frames([0.0], fine.points, fine.triangles)}
    for i in range(5):
        found[f"other_{i}"] = frames([0.0], box["points"] * [1, 1, 1.2 + 0.1 * i])
    for seed in range(20):
        split = dataset.splits(found, seed)["shape"]
        assert sorted([*split["train"], *split["test"]]) == sorted(found)
        assert split["test"]
        assert len({"box", "turned", "fine"} & {*split["test"]}) in (0, 3)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A small data set."""
    if not fenicsx.processes.installed():
        pytest.skip("FEniCSx is not installed")
    folder = tmp_path_factory.mktemp("dataset")
    return folder / "set", dataset.build(folder / "set", SMALL, folder / "runs", Workers())


@pytest.mark.slow
@pytest.mark.nightly
def test_it_is_loaded_whole_and_the_same_after_a_kill(made) -> None:
    folder, index = made
    assert index["scenes"] + len(index["left_out"]) == 2
    assert set(index["sha256"]) >= {"load.py", "datacite.json"}
    for arrays, rows in dataset_loader.load(folder):
        assert rows[0] == 0
        assert np.abs(arrays["positions"][0] - arrays["points"]).max() == 0
        assert np.abs(arrays["tet_positions"][0] - arrays["tet_points"]).max() < 1e-12
        # The clamped end is nearest to where its bone takes it in the same frame: states are under their own poses.
        end, lower = arrays["points"][:, 2] == 0, list(arrays["bones"]).index("lower")
        turns = arrays["poses"][:, lower]
        wanted = arrays["points"][end] @ turns[:, :3, :3].transpose(0, 2, 1) + turns[:, None, :3, 3]
        away = np.linalg.norm(arrays["positions"][:, None, end] - wanted[None], axis=3).mean(axis=2)
        assert away.argmin(axis=1).tolist() == list(range(len(turns)))
    victim = next(iter(sorted((folder / "scenes").iterdir()))) / "frames.npz"
    (folder / dataset.INDEX).unlink()
    victim.write_bytes(b"half")
    (victim.parent / ".frames-1.npz").write_bytes(b"half")
    again = dataset.build(folder, SMALL, folder.parent / "runs", Workers())
    assert json.dumps(again) == json.dumps(index)


@pytest.mark.slow
@pytest.mark.nightly
def test_what_is_damaged_or_of_another_version_is_refused(made, tmp_path) -> None:
    folder, _ = made
    copy = shutil.copytree(folder, tmp_path / "copy")
    with pytest.raises(InputError, match="another folder for"):
        dataset.build(copy, replace(SMALL, seed=2), tmp_path / "runs", Workers())
    victim = next(copy.rglob("frames.npz"))
    victim.write_bytes(victim.read_bytes()[:-1])
    with pytest.raises(ValueError, match=r"frames\.npz is not the file"):
        dataset_loader.load(copy)


@pytest.mark.slow
@pytest.mark.nightly
def test_no_state_that_is_denied_or_unchecked_or_without_bar_is_a_truth(made) -> None:
    folder, index = made
    name = next(iter(index["splits"]["pose"]["train"]))
    case = dataset.random_muscles.write(folder / "scenes" / name, 1, int(name[-1]), 2)
    bench = Bench(case, folder.parent / "runs", 1)
    run = bench.reference()
    bars = refinement.stored(run)
    assert dataset.unfit(bench, run, bars) == ""
    assert dataset.unfit(bench, run, None) == "no error bar"
    assert "diverged" in dataset.unfit(bench, replace(run, outcome=replace(run.outcome, status="diverged")), bars)
    origin = {key: value for key, value in run.origin.items() if key != second_check.RECORD}
    assert dataset.unfit(bench, replace(run, origin=origin), bars) == "no second check that passes"
    lost = replace(run, positions=run.positions * 1.05)
    assert "volume fail" in dataset.unfit(bench, lost, bars)
    unstable = replace(run, scalars=run.scalars | {"negative_modes": np.ones(len(run.numbers))})
    assert "unstable" in dataset.unfit(bench, unstable, bars)


def test_a_folder_with_other_files_is_refused(tmp_path) -> None:
    (tmp_path / "thesis.txt").write_text("mine")
    with pytest.raises(InputError, match="a folder with other files"):
        dataset.build(tmp_path, SMALL, tmp_path / "runs", Workers())
    assert (tmp_path / "thesis.txt").exists()


def test_a_shipped_case_with_anatomy_is_left_out(tmp_path) -> None:
    """It is read only, and never solved: nothing is in the folder."""
    wanted = Sizes(0, 2, shipped=("gluteus_medius",))
    with pytest.raises(InputError, match="anatomy with its own licence"):
        dataset.build(tmp_path / "set", wanted, tmp_path / "runs", Workers())


def test_metadata_has_what_datacite_requires() -> None:
    found = dataset.metadata(SMALL, 2, 6)
    assert {"creators", "titles", "publisher", "publicationYear", "types", "version"} <= set(found)
