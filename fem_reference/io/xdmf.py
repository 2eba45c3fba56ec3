"""Time series in XDMF, read with meshio. Their data are in the file itself or in HDF5 files in the same folder."""

from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.io import soup
from fem_reference.io.texts import beside, parsed_xml

# The maximum number of values in an array: ten million points.
_MOST = 3 * 10**7


def read(path: Path) -> list[tuple[float, Floats, Ints]]:
    """The time, the positions of the points, and the triangles of each step."""
    import meshio

    for item in parsed_xml(path).iter("DataItem"):
        _check(item, path)
    with meshio.xdmf.TimeSeriesReader(path) as series:
        points, triangles = soup.arrays(soup.of_meshio(*series.read_points_cells()))
        steps = [series.read_data(step)[:2] for step in range(series.num_steps)]
    return [(time, points + _displacement(data, points), triangles) for time, data in steps]


def _displacement(data: dict[str, Any], points: Floats) -> Any:
    """The displacement in the point ``data`` of a step. Raises ValueError unless there is one with the shape of ``points``."""
    name = next((name for name in ("displacement", "u") if np.shape(data.get(name, 0)) == points.shape), None)
    if name is None:
        raise ValueError(f"point data {', '.join(data) or '(none)'} in a step")
    return data[name]


def _check(item: Element, path: Path) -> None:
    """Raise ValueError if the data of an ``item`` are neither in the file at ``path`` nor in an HDF5 file in its folder."""
    if item.get("Format") == "XML":
        return
    if item.get("Format") != "HDF":
        raise ValueError(f'numbers in the format "{item.get("Format")}"')
    name, colon, place = (item.text or "").strip().partition(":")
    if not colon or not place.startswith("/"):
        raise ValueError(f'"{item.text}", which is not FILE:/PLACE')
    import h5py

    with h5py.File(beside(path, name), "r") as file:
        _check_dataset(file, place)


def _check_dataset(file: Any, place: str) -> None:
    """Raise ValueError if the dataset at ``place`` in an HDF5 file is not numeric, is stored outside this file, or is too large."""
    import h5py

    names = ["", *place.strip("/").split("/")]
    steps = ["/".join(names[: i + 1]) or "/" for i in range(len(names))]
    for above, step in pairwise(steps):
        if not isinstance(file[above].get(step.rpartition("/")[2], getlink=True), h5py.HardLink):
            raise ValueError(f'"{step}", a link to another place')
    dataset = file[place]
    own = isinstance(dataset, h5py.Dataset) and not (dataset.external or dataset.is_virtual)
    if not own or dataset.dtype.kind not in "fiu":
        raise ValueError(f'"{place}", which is not an array of numbers in this file')
    if dataset.size > _MOST:
        raise ValueError(f'{dataset.size} numbers at "{place}", more than {_MOST}')
