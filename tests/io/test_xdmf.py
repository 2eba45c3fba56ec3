"""Time series in XDMF: they move by their displacement, and numbers that are elsewhere, too many or not there are refused."""

import re
from contextlib import chdir
from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest
import shapes

from fem_reference.foundations.errors import InputError
from fem_reference.io import files

BALL = shapes.sphere(2, 30.0)
MOVED = BALL.points + np.random.default_rng(1).normal(size=BALL.points.shape)


def write_series(path: Path, data_format: str = "XML", **data: np.ndarray) -> None:
    """Two steps at 0 and 0.5 s; each value of ``data`` is that of the second; meshio puts its .h5 beside the path."""
    with chdir(path.parent), meshio.xdmf.TimeSeriesWriter(path, data_format=data_format) as series:
        series.write_points_cells(BALL.points, [("triangle", BALL.triangles)])
        for time in (0.0, 0.5):
            series.write_data(time, point_data={name: 2 * time * values for name, values in data.items()})


@pytest.mark.parametrize("name", ["displacement", "u"])
def test_a_series_moves_by_its_displacement(tmp_path: Path, name: str) -> None:
    write_series(tmp_path / "run.xdmf", **{name: MOVED - BALL.points, "velocity": BALL.points})
    (start, first), (end, last) = files.read_xdmf(tmp_path / "run.xdmf", 10.0)
    assert (start, end) == (0.0, 0.5)
    # meshio writes 17 digits, so that only the sum is rounded: a unit in the last place of 300 mm is 6e-14.
    assert np.allclose(first.points, 10 * BALL.points, rtol=0, atol=1e-13)
    assert np.allclose(last.points, 10 * MOVED, rtol=0, atol=1e-13)
    assert last.place == f"{tmp_path / 'run.xdmf'}: time 0.5"


@pytest.mark.parametrize("relative", [False, True])
def test_a_series_whose_numbers_are_in_hdf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, relative: bool) -> None:
    """As meshio chooses by itself; the .h5 is beside the .xdmf, wherever we are."""
    (tmp_path / "there").mkdir()
    write_series(tmp_path / "there" / "run.xdmf", "HDF", displacement=MOVED - BALL.points)
    assert (tmp_path / "there" / "run.h5").is_file()
    monkeypatch.chdir(tmp_path)
    (start, first), (end, last) = files.read_xdmf(Path("." if relative else tmp_path) / "there" / "run.xdmf", 10.0)
    assert (start, end) == (0.0, 0.5)
    assert np.array_equal(first.points, 10 * BALL.points)
    assert np.array_equal(first.triangles, BALL.triangles)
    assert np.allclose(last.points, 10 * MOVED, rtol=0, atol=1e-13)  # the sum is rounded, as above


@pytest.mark.parametrize("share", [None, 0.0, 0.5])
def test_a_series_without_its_hdf_is_refused(tmp_path: Path, share: float | None) -> None:
    write_series(tmp_path / "run.xdmf", "HDF", displacement=MOVED - BALL.points)
    store = tmp_path / "run.h5"
    if share is None:
        store.unlink()
    else:
        store.write_bytes(store.read_bytes()[: int(share * store.stat().st_size)])
    with pytest.raises(InputError, match=r"run\.xdmf: got .*open file.*, want an XDMF time series"):
        files.read_xdmf(tmp_path / "run.xdmf", 1.0)


def test_a_series_without_displacement_is_refused(tmp_path: Path) -> None:
    write_series(tmp_path / "run.xdmf", velocity=MOVED)
    with pytest.raises(InputError, match=r"run\.xdmf: got point data velocity in a step, want an XDMF time series"):
        files.read_xdmf(tmp_path / "run.xdmf", 1.0)


def test_a_cut_series_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.xdmf"
    write_series(path, displacement=MOVED)
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(InputError, match=r"run\.xdmf: got .*, want an XDMF time series"):
        files.read_xdmf(path, 1.0)


def _series(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder.mkdir()
    monkeypatch.chdir(folder)  # where meshio puts its .h5
    with meshio.xdmf.TimeSeriesWriter(folder / "run.xdmf") as series:
        series.write_points_cells(BALL.points, [("triangle", BALL.triangles)])
        series.write_data(0.0, point_data={"displacement": 0 * BALL.points})
    return folder


@pytest.mark.parametrize("link", ["external", "soft", "virtual", "huge"])
def test_numbers_behind_links_of_hdf5_are_refused(link: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = _series(tmp_path / "a", monkeypatch)
    assert len(files.read_xdmf(folder / "run.xdmf", 1.0)) == 1
    with h5py.File(tmp_path / "secret.h5", "w") as secret:
        secret["data0"] = BALL.points
    with h5py.File(folder / "run.h5", "a") as file:
        del file["data0"]
        if link == "external":
            file["data0"] = h5py.ExternalLink("../secret.h5", "/data0")
        elif link == "soft":
            file["data0"] = h5py.SoftLink("/data1")
        elif link == "huge":
            file.create_dataset("data0", (10**12, 3), float, chunks=(1000, 3))
        else:
            layout = h5py.VirtualLayout(BALL.points.shape, float)
            layout[:] = h5py.VirtualSource("../secret.h5", "data0", BALL.points.shape)
            file.create_virtual_dataset("data0", layout)
    with pytest.raises(InputError, match=r'run\.xdmf: got .*"/data0"'):
        files.read_xdmf(folder / "run.xdmf", 1.0)


@pytest.mark.parametrize(
    ("old", "new", "got"),
    [
        ("run.h5:/", "../b/run.h5:/", 'a reference to "../b/run.h5", outside'),
        ('Format="HDF"', 'Format="Binary"', 'numbers in the format "Binary"'),
        ("run.h5:/data0", "run.h5", "which is not FILE:/PLACE"),
        ("<Xdmf", '<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/hostname">]><Xdmf', "a document type"),
    ],
)
def test_a_series_names_files_beside_it_only(
    old: str, new: str, got: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = _series(tmp_path / "a", monkeypatch)
    text = (folder / "run.xdmf").read_text()
    assert old in text
    (folder / "run.xdmf").write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=re.escape(got)):
        files.read_xdmf(folder / "run.xdmf", 1.0)
