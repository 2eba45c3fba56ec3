"""Meshes of scalar cases: nodes that are given, evenly spaced or drawn, and triangles of files."""

import fields
import numpy as np
import pytest
import shapes

from fem_reference.foundations.errors import InputError
from fem_reference.io import files
from fem_reference.problems.domain import mesh_of, numbers, whole_numbers

INTERVAL = {"start": 0.0, "end": 1.0, "count": 5}


def scene(folder, domain):
    """A scene of diffusion on ``domain``."""
    return fields.scene(folder, domain=domain, effect=[{"name": "diffusion", "coefficient": 1.0}])


def test_nodes_at_random_are_those_of_the_seed(tmp_path) -> None:
    drawn = [scene(tmp_path, {"interval": INTERVAL | {"seed": seed}}) for seed in (1, 1, 2)]
    one, again, other = (mesh_of(entry).points[:, 0] for entry in drawn)
    assert (one == again).all()
    assert (one != other).any()
    assert (one[0], one[-1], len(one)) == (0, 1, 5)
    assert (np.diff(one) > 0).all()


@pytest.mark.parametrize(
    ("points", "match"),
    [
        ("0,0\n1,1\n2,2\n", "points that cannot be triangulated"),
        ("0,0,0\n1,0,0\n0,1,0\n", '"delaunay" of points in space'),
    ],
)
def test_points_that_delaunay_cannot_do(tmp_path, points, match) -> None:
    (tmp_path / "points.csv").write_text(points)
    domain = {"mesh": {"points": "points.csv", "triangles": "delaunay"}}
    with pytest.raises(InputError, match=match):
        mesh_of(scene(tmp_path, domain))


def test_an_interval_is_divided_evenly_and_nodes_are_as_given(tmp_path) -> None:
    even = mesh_of(scene(tmp_path, {"interval": {"start": -1.0, "end": 2.0, "count": 4}}))
    assert even.points[:, 0].tolist() == [-1, 0, 1, 2]
    given = mesh_of(scene(tmp_path, {"nodes": [0.0, 0.25, 2.0]}))
    assert given.points[:, 0].tolist() == [0, 0.25, 2]
    assert given.cells.tolist() == [[0, 1], [1, 2]]
    assert given.sizes == pytest.approx([0.25, 1.75])


def test_a_square_has_its_area_by_its_triangles_and_by_those_of_delaunay(tmp_path) -> None:
    domain = fields.square(tmp_path, 5)
    made = domain["mesh"] | {"triangles": "delaunay"}
    one, other = (mesh_of(scene(tmp_path, entry)) for entry in (domain, {"mesh": made}))
    assert one.sizes.sum() == pytest.approx(1, abs=1e-12)
    # The same points, and as many triangles: an edge may be turned where four points are on a circle.
    assert np.array_equal(one.points, other.points)
    assert len(one.cells) == len(other.cells) == 2 * 4 * 4
    assert other.sizes.sum() == pytest.approx(1, abs=1e-12)


def test_a_surface_in_a_file_is_scaled_to_millimetres(tmp_path) -> None:
    ball = shapes.sphere(2)
    files.write_surface(tmp_path / "ball.vtp", ball, ball.points)
    sizes = [
        mesh_of(scene(tmp_path, {"surface": {"file": "ball.vtp", "scale": scale}})).sizes.sum() for scale in (1.0, 10.0)
    ]
    assert sizes[1] == pytest.approx(100 * sizes[0])
    assert sizes[0] == pytest.approx(4 * np.pi, rel=0.05)


def test_a_table_is_of_finite_numbers_and_whole_where_it_counts(tmp_path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("1,2.5\n-3,4\n")
    assert numbers(path).tolist() == [[1, 2.5], [-3, 4]]
    with pytest.raises(InputError, match=r"the vertex 2\.5"):
        whole_numbers(path, numbers(path))
    found = whole_numbers(path, np.array([[1.0, 2], [-3, 4]]))
    assert found.dtype == np.int64
    assert found.tolist() == [[1, 2], [-3, 4]]
    for text, want in (("1\n1,2\n", "1 as in row 1"), ("inf\n", "rows of finite numbers"), ("a\n", "numbers")):
        path.write_text(text)
        with pytest.raises(InputError, match=f"want {want}"):
            numbers(path)
