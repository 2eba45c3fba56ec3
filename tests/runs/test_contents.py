"""The contents of run.json: read strictly, so that each damage is named."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.runs import store
from fem_reference.runs.contents import amend, frame_file
from tests.runs.stored import write

SCALARS = {
    f"{kind}_on_femur_{axis}": np.full(2, 2.0 * (kind + axis == "forcex"))
    for kind in ("force", "moment")
    for axis in "xyz"
}


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


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"numbers": [0, 0]}, r"numbers: got \[0, 0\], want frame numbers that increase"),
        ({"numbers": [5, 0]}, r"numbers: got \[5, 0\], want frame numbers that increase"),
        ({"numbers": [-5, 0]}, r"numbers\[0\]: got -5, want greater than or equal to 0"),
        ({"numbers": [0]}, r"want as many values of each scalar as frame numbers"),
        ({"scalars": {"energy": [1.0]}}, r"want as many values of each scalar as frame numbers"),
        ({"status": "fine"}, r'status: got "fine", want'),
        ({"colour": "red"}, r"colour: got an unknown key, want one of"),
    ],
)
def test_contents_that_contradict_themselves_are_named(
    changes: dict[str, object], message: str, tmp_path: Path
) -> None:
    folder = write(tmp_path / "run")
    amend(folder, **changes)
    with pytest.raises(InputError, match=message):
        store.load(folder)


def test_what_is_amended_leaves_the_rest(tmp_path: Path) -> None:
    folder = write(tmp_path / "run")
    before = json.loads((folder / "run.json").read_text())
    amend(folder, message="another", name="other")
    assert json.loads((folder / "run.json").read_text()) == before | {"message": "another", "name": "other"}
    assert store.load(folder).name == "other"


def test_frames_between_whole_numbers_share_no_file() -> None:
    assert frame_file(10.0, ".vtp") == frame_file(10, ".vtp") == "frame_0010.vtp"
    with pytest.raises(ValueError, match=r"frame 0\.2 has no file, as its number is not an integer"):
        frame_file(0.2, ".vtp")


@pytest.mark.parametrize(
    "centre",
    [(1, 2), (0, 0, math.nan), (0, 0, math.inf), "1, 2, 3 mm", None, Path("x"), [[0, 0, 0]], (0, 0, 10**400), []],
)
def test_a_moment_is_about_a_point(centre, tmp_path) -> None:
    """Not-a-number for a centre would make every moment one, and a row of points another question."""
    pulled = replace(store.load(write(tmp_path / "run")), scalars=SCALARS)
    with pytest.raises(InputError, match=r"centre: got .*, want a point: three finite numbers \[mm\]"):
        pulled.moment("femur", centre)
    # 2 N along x at the origin, whose moment is 0, has about (0, 0, 3) mm one of -6 N mm along y.
    assert pulled.moment("femur", np.array([0, 0, 3])).tolist() == [[0.0, -6.0, 0.0]] * 2
