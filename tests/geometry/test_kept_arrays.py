"""Arrays kept on disk: made once, read bit by bit, and made anew where they are damaged or cannot be kept."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fem_reference.geometry.kept_arrays import kept

VALUES = np.array([1 / 3, -0.0, 1e-320, np.inf])


@pytest.fixture
def asked() -> tuple[list[int], Callable[[Path], np.ndarray]]:
    """Each time that the values are made, and a call for them."""
    made: list[int] = []

    def make() -> np.ndarray:
        made.append(len(made))
        return VALUES

    return made, lambda path: kept(path, make, lambda values: {"values": values}, lambda arrays: arrays["values"])


def test_arrays_are_made_once_and_come_back_bit_by_bit(asked, tmp_path: Path) -> None:
    made, call = asked
    for _ in range(3):
        assert call(tmp_path / "a" / "b.npz").tobytes() == VALUES.tobytes()
    assert made == [0]
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["b.npz"]


@pytest.mark.parametrize("data", ["cut", b"", b"no arrays at all"])
def test_a_damaged_file_is_made_anew(data, asked, tmp_path: Path, caplog) -> None:
    made, call = asked
    path = tmp_path / "b.npz"
    call(path)
    path.write_bytes(path.read_bytes()[:50] if data == "cut" else data)
    assert call(path).tobytes() == VALUES.tobytes()
    assert call(path).tobytes() == VALUES.tobytes()
    assert made == [0, 1]
    assert f"{path}: damaged, made anew" in caplog.text


def test_arrays_that_are_programs_are_not_run(asked, tmp_path: Path, caplog) -> None:
    made, call = asked
    np.savez(tmp_path / "b.npz", values=np.array([print], object))
    assert call(tmp_path / "b.npz").tobytes() == VALUES.tobytes()
    assert made == [0]
    assert "Object arrays cannot be loaded" in caplog.text


def test_a_place_that_cannot_be_written_is_no_reason_to_fail(asked, tmp_path: Path, caplog) -> None:
    made, call = asked
    (tmp_path / "file").write_text("")
    assert call(tmp_path / "file" / "b.npz") is VALUES
    assert made == [0]
    assert "not kept" in caplog.text
