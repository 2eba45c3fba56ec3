"""Attachments and fibres of a case: what a file lists, what lies near, patches of landmarks, and where lines and directions are."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import random_scenes
import shapes
from auto_scenes import STILL, pennate
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import (
    Polylines,
    Surface,
    TetMesh,
    check_closed,
    triangle_areas,
    vertex_areas,
)
from fem_reference.geometry.distance import distances
from fem_reference.geometry.sectors import attached_shares
from fem_reference.geometry.skins import edge_lengths
from fem_reference.io import files
from fem_reference.problems import anatomy, muscle
from fem_reference.problems.anatomy import draped, facets_under, fan, pick
from fem_reference.problems.estimates import estimates
from fem_reference.problems.fibre_ends import REACHES, attached_ends
from fem_reference.scenes import casefile
from fem_reference.scenes.fibres import Fibres, FibreTurn
from fem_reference.scenes.muscle import Attachment, MuscleCase, Shift

BLOCK = shapes.skin(shapes.box((10, 10, 2), (20.0, 20.0, 4.0)))
FLOOR = Surface(np.array([[-50.0, -50, -1], [50, -50, -1], [0, 80, -1]]), np.array([[0, 1, 2]]))
HIP = np.array([146.0, 238.0, -431.0])  # [mm]
RING = [(6, 6), (14, 14), (14, 6), (6, 14), (10, 5), (10, 15)]  # [mm], not in the order of their angles


GROUND = FLOOR.moved_to(FLOOR.points + np.array([0, 0, 1.0]))  # right below the block


def _pick(folder: Path, surface: Surface = BLOCK, bone: Surface = FLOOR, **selection: Any) -> np.ndarray:
    attachment = Attachment(name="origin", bone="floor", **selection)
    return pick(
        MuscleCase.model_construct(folder=folder, place="case.toml", attachment=(attachment,)), 0, surface, bone
    )


def _listed(folder: Path, text: str, **keys: Any) -> np.ndarray:
    (folder / "list.csv").write_text(text, encoding="utf-8")
    return _pick(folder, vertices={"file": "list.csv", **keys})


def _outline(
    folder: Path, text: str, reach: str = "1 mm", clouds: tuple[str, ...] = ("A",), unit: str = "mm", **keys: object
) -> np.ndarray:
    (folder / "marks.csv").write_text(text)
    keys |= {"file": "marks.csv", "unit": unit, "clouds": clouds, "reach": reach}
    return _pick(folder, bone=GROUND, outline=keys)


def _marks(points: np.ndarray, cloud: str = "A") -> str:
    rows = [f"{cloud},{i},{x},{y},{z}" for i, (x, y, z) in enumerate(points)]
    return "\n".join(["cloud,landmark,x_mm,y_mm,z_mm", *rows])


def test_listed_vertices_come_sorted_and_once(tmp_path: Path) -> None:
    text = "# chosen by hand\nvertex\n7\n3\n\n7\n0\n"
    assert_array_equal(_listed(tmp_path, text), [0, 3, 7])


def test_a_value_chooses_among_the_rows(tmp_path: Path) -> None:
    text = "# vertex, bone\n4,1\n5,2\n2,1\n"
    assert_array_equal(_listed(tmp_path, text, value=1), [2, 4])
    assert_array_equal(_listed(tmp_path, text, value=2), [5])
    assert_array_equal(_listed(tmp_path, text), [2, 4, 5])
    assert len(_listed(tmp_path, text, value=3)) == 0


@pytest.mark.parametrize(
    ("text", "keys", "what"),
    [
        ("vertex\n3\n9999\n", {}, r'list.csv: row 3: got "9999", want a vertex from 0 to 281'),
        ("3\n-1\n", {}, r'list.csv: row 2: got "-1"'),
        ("3\nfour\n", {}, r'list.csv: row 2: got "four"'),
        ("3\n4.0\n", {}, r'list.csv: row 2: got "4.0"'),
        ("vertex,value\n3,1\n4\n", {"value": 1}, r'list.csv: row 3: got "4", want a vertex and its value'),
        ("1.5\n3\n", {}, r'list.csv: row 1: got "1.5", want a vertex from 0 to 281'),
        ("1e2\n3\n", {}, r'list.csv: row 1: got "1e2"'),
        ("-\n3\n", {}, r'list.csv: row 1: got "-"'),
        (",7\n3\n", {}, r'list.csv: row 1: got ""'),
        ("3\n\u00b2\n", {}, r'list.csv: row 2: got "\u00b2"'),
        (f"3\n{'9' * 5000}\n", {}, rf'list.csv: row 2: got "{"9" * 40}\.\.\.", want a vertex'),
        (f"3,{'9' * 5000}\n", {"value": 1}, rf'list.csv: row 1: got "3,{"9" * 38}\.\.\.", want a vertex and its value'),
        ("3,femur\n", {"value": 1}, r'list.csv: row 1: got "3,femur", want a vertex and its value'),
    ],
)
def test_a_wrong_list_is_named(tmp_path: Path, text: str, keys: dict[str, int], what: str) -> None:
    with pytest.raises(InputError, match=what):
        _listed(tmp_path, text, **keys)


def test_a_list_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"case.toml: attachment\[0\].vertices.file: got .*nowhere.csv"):
        _pick(tmp_path, vertices={"file": "nowhere.csv"})


def test_within_takes_the_vertices_near_the_bone(tmp_path: Path) -> None:
    heights = BLOCK.points[:, 2] + 1  # above the floor at z = -1
    for reach in (0.5, 1.0, 3.0, 9.0):
        assert_array_equal(_pick(tmp_path, within=f"{reach} mm"), np.flatnonzero(heights <= reach))


def test_an_outline_takes_what_is_near_its_patch(tmp_path: Path) -> None:
    found = _outline(tmp_path, _marks(np.array([(x, y, 0) for x, y in RING])))
    x, y, z = BLOCK.points.T
    # The hexagon's corners in order: distance to it is 0 inside, and the vertices stand 2 mm apart.
    inside = (x >= 6) & (x <= 14) & (y >= 5 + abs(x - 10) / 4) & (y <= 15 - abs(x - 10) / 4) & (z == 0)
    beside = (np.abs(x - 10) <= 4) & (np.abs(y - 10) <= 6) & (z == 0)
    assert set(np.flatnonzero(inside)) <= set(found) <= set(np.flatnonzero(beside))


def test_a_shifted_outline_takes_what_is_that_much_further(tmp_path: Path) -> None:
    """Landmarks of a plane bone, 4 mm further: two of the 2 mm between vertices."""
    marks = _marks(np.array([(x - 3, y, 0) for x, y in RING]))
    there = _outline(tmp_path, marks, "1.3 mm")
    found = _outline(tmp_path, marks, "1.3 mm", shift=Shift(along=(2, 0, 0), by="4 mm"))
    assert {*map(tuple, BLOCK.points[found])} == {*map(tuple, BLOCK.points[there] + np.array([4.0, 0, 0]))}


def test_an_outline_does_not_depend_on_unit_order_or_place(tmp_path: Path) -> None:
    points = np.array([(x, y, -0.3 * (x > 9)) for x, y in RING])
    found = _outline(tmp_path, _marks(points), reach="2.5 mm")
    assert len(found) > 10
    assert_array_equal(_outline(tmp_path, _marks(points[::-1] / 10), reach="2.5 mm", unit="cm"), found)
    turn = Rotation.random(rng=np.random.default_rng(11))
    (tmp_path / "marks.csv").write_text(_marks(turn.apply(points) + HIP))
    outline = {"file": "marks.csv", "unit": "mm", "clouds": ("A",), "reach": "2.5 mm"}
    turned = BLOCK.moved_to(turn.apply(BLOCK.points) + HIP)
    ground = GROUND.moved_to(turn.apply(GROUND.points) + HIP)
    assert_array_equal(_pick(tmp_path, turned, ground, outline=outline), found)


def test_an_outline_over_a_hollow_lies_on_the_bone(tmp_path: Path) -> None:
    # The muscle fills a bowl of radius 60 mm, 10 mm deep, up to a sphere 6 mm above it; the landmarks stand on the rim, 10 mm above
    # the bottom: flat between them, the patch would touch the upper side.
    rim = 60 * np.sin(np.arccos(5 / 6))
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    marks = np.stack([rim * np.cos(angles), rim * np.sin(angles), np.full(24, 10.0)], axis=1)
    x, y = np.meshgrid(np.linspace(-40, 40, 81), np.linspace(-40, 40, 81))
    cell = np.arange(81 * 81).reshape(81, 81)
    a, b, c, d = (part.ravel() for part in (cell[:-1, :-1], cell[:-1, 1:], cell[1:, :-1], cell[1:, 1:]))
    triangles = np.concatenate([np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)])
    bowl = Surface(
        np.stack([x.ravel(), y.ravel(), 60 - np.sqrt(3600 - x.ravel() ** 2 - y.ravel() ** 2)], axis=1), triangles
    )
    both = Surface(np.concatenate([bowl.points, bowl.points + np.array([0, 0, 6.0])]), bowl.triangles)
    (tmp_path / "marks.csv").write_text(_marks(marks))
    outline = {"file": "marks.csv", "unit": "mm", "clouds": ("A",), "reach": "2 mm"}
    found = _pick(tmp_path, both, bowl, outline=outline)
    radius = np.linalg.norm(both.points[:, :2], axis=1)
    # A polygon of 24 sides reaches cos(7.5 degrees) of its radius, and its points move inwards, not out, when laid down: by the
    # sphere's normal, up to 10 mm times its slope. The upper side stays at least 4 mm away from the bone.
    assert set(np.flatnonzero(radius[: len(bowl.points)] < 0.8 * rim)) <= set(found)
    assert found.max() < len(bowl.points)
    assert radius[found].max() < rim + 2


def test_two_clouds_are_two_patches(tmp_path: Path) -> None:
    square = np.array([(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)])
    text = _marks(square) + "\n" + _marks(square + np.array([16, 16, 0]), "B").split("\n", 1)[1]
    found = _outline(tmp_path, text, reach="0.1 mm", clouds=("A", "B"))
    low, high = (
        BLOCK.points.max(axis=1) <= 2,
        (BLOCK.points[:, :2].min(axis=1) >= 16) & (BLOCK.points[:, :2].max(axis=1) <= 18),
    )
    assert_array_equal(found, np.flatnonzero((low | high) & (BLOCK.points[:, 2] == 0)))


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (
            _marks(np.eye(3), "B"),
            r'attachment\[0\].outline.clouds: got "A", which .*marks.csv does not have, want some of B',
        ),
        (_marks(np.eye(3)[:2]), r'marks.csv: cloud "A": got 2 landmarks, want at least three'),
        (_marks(np.eye(3)) + "\nA,4,0,nan,1", r'marks.csv: row 5: got "A,4,0,nan,1", want cloud, landmark and three'),
        (_marks(np.eye(3)) + "\nA,4,0,1", r'marks.csv: row 5: got "A,4,0,1"'),
        (_marks(np.eye(3)) + "\nA", r'marks.csv: row 5: got "A"'),
        (_marks(np.eye(4, 3)).split("\n", 1)[1], r"marks.csv: row 1: got .*, want a header row: cloud,landmark,x,y,z"),
        (_marks(np.eye(3)) + "\nA,4,0,east,1", r'marks.csv: row 5: got "A,4,0,east,1"'),
    ],
)
def test_a_wrong_outline_is_named(tmp_path: Path, text: str, what: str) -> None:
    with pytest.raises(InputError, match=what):
        _outline(tmp_path, text)


def test_facets_under_a_face_are_that_face() -> None:
    # One layer: on its sides the share sinks to 0 in half the height, 5/12 on average over a triangle that stands.
    mesh = shapes.box((5, 4, 1), (20.0, 20.0, 4.0))
    bottom = np.flatnonzero(BLOCK.points[:, 2] == 0)
    facets = facets_under(mesh, BLOCK, attached_shares(BLOCK, bottom))
    assert {tuple(sorted(facet)) for facet in facets.tolist()} == {
        tuple(sorted(facet)) for facet in mesh.facets["bottom"].tolist()
    }
    a, b, c = (mesh.points[facets[:, corner]] for corner in range(3))
    assert (np.cross(b - a, c - a)[:, 2] < 0).all()  # outward


def test_no_vertices_have_no_facets() -> None:
    nothing = np.zeros(BLOCK.triangles.shape)
    assert facets_under(shapes.box((2, 2, 2), (20.0, 20.0, 4.0)), BLOCK, nothing).shape == (0, 3)


def test_the_area_converges_as_the_tets_shrink() -> None:
    disc = np.flatnonzero((np.hypot(*(BLOCK.points[:, :2] - 10).T) < 7) & (BLOCK.points[:, 2] == 0))
    wanted = vertex_areas(BLOCK.points, BLOCK.triangles)[disc].sum()
    for cells, within in ((10, 0.1), (30, 0.03)):
        mesh = shapes.box((cells, cells, 2), (20.0, 20.0, 4.0))
        area = triangle_areas(mesh.points, facets_under(mesh, BLOCK, attached_shares(BLOCK, disc))).sum()
        # A rim of 44 mm around 154 mm2, off by a tenth of a facet's side on average at most: 0.2 mm, then 0.07 mm.
        assert_allclose(area, wanted, rtol=within)


@pytest.mark.slow
def test_the_origins_of_gluteus_maximus(data: Path, tmp_path: Path) -> None:
    muscle = check_closed(files.read_surface(data / "hip/muscles/gluteus_maximus.vtk", 1.0))
    clouds = tuple(f"LC_SET_Ori_{i}_R_M081_Glut_Max" for i in (1, 2))
    bones = [files.read_surface(data / f"hip/bones/{name}.ply", 1.0) for name in ("iliac_r", "sacrum")]
    table = {"file": str(data / "hip/landmarks.csv"), "unit": "mm"}
    near, far = (
        {
            vertex
            for cloud, bone in zip(clouds, bones, strict=True)
            for vertex in _pick(tmp_path, muscle, bone, outline=table | {"clouds": (cloud,), "reach": reach})
        }
        for reach in ("5 mm", "10 mm")
    )
    rows = [row for row in files.read_rows(data / "hip/landmarks.csv") if row[0] in clouds]
    landmarks = np.array([row[2:] for row in rows], float)
    to_landmarks = np.linalg.norm(muscle.points[:, None] - landmarks, axis=2)
    # Landmarks are corners of the patches, and a patch reaches no farther from its centroid than they do.
    assert set(np.flatnonzero(to_landmarks.min(axis=1) < 5)) <= near < far
    in_cloud = np.array([[row[0] == cloud for row in rows] for cloud in clouds])
    centres = np.array([landmarks[cloud].mean(axis=0) for cloud in in_cloud])
    radii = [
        np.linalg.norm(landmarks[cloud] - centre, axis=1).max() for cloud, centre in zip(in_cloud, centres, strict=True)
    ]
    to_centres = np.linalg.norm(muscle.points[:, None] - centres, axis=2)
    assert far <= set(np.flatnonzero((to_centres <= np.array(radii) + 10).any(axis=1)))


def test_given_fibres_stay_inside_the_muscle(bar) -> None:
    surface = muscle.setup(casefile.read(bar)).surface
    inside, far = [5.0, 5.0, 20.0], [5.0, 30.0, 20.0]
    given = Polylines(np.array([inside, far]), np.array([0, 2]))
    moved = anatomy.inside(surface, given)
    assert np.array_equal(moved.points[0], inside)
    # The nearest point of the side, which bulges to y = 5 + 5 * 1.3 = 11.5 halfway up.
    assert moved.points[1] == pytest.approx([5, 11.5, 20], abs=1e-9)


@pytest.mark.slow
def test_given_fibres_are_read_and_completed(bar) -> None:
    """The line begins 8 mm above the bottom and ends less than 2 mm below the top, which is close enough."""
    lines = Polylines(np.array([[5.0, 5, 8], [5, 5, 20], [5, 5, 38.1]]), np.array([0, 3]))
    files.write_polylines(bar / "lines.vtp", lines, lines.points)
    text = (bar / "case.toml").read_text()
    traced = 'traced = { count = 4, start = "origin", end = "insertion" }'
    assert traced in text
    (bar / "case.toml").write_text(text.replace(traced, 'polylines = { file = "lines.vtp", unit = "mm" }'))
    try:
        for complete, length, beside in ((False, 30.1, 1), (True, 38.1, 0)):
            case = casefile.read_muscle(bar, {"fibres.complete": complete})
            built = muscle.build(case, muscle.setup(case))
            assert built.fibres.lengths() == pytest.approx([length], rel=1e-6)
            assert built.mesh_facts["fibre_ends_beside"] == beside
    finally:
        (bar / "case.toml").write_text(text)


@pytest.mark.slow
def test_fibres_at_an_angle_lean_by_the_sine_of_twice_that(tmp_path) -> None:
    scene = pennate(tmp_path / "scene", "auto")
    assert estimates(scene, muscle.setup(scene)).lean == pytest.approx(np.sin(np.radians(50)))
    case = random_scenes.TEXT.format(**STILL, choice="auto", effects="")
    straight = random_scenes.write(tmp_path / "straight", case, random_scenes.lines(0.0, 0.0))
    assert estimates(straight, muscle.setup(straight)).lean == pytest.approx(0, abs=1e-6)


def test_lines_that_are_given_are_the_directions(tmp_path) -> None:
    """At 25 degrees to the axis, in the plane of x and z; no mesh is made for them."""
    case = pennate(tmp_path / "scene", "listed")
    surface = muscle.setup(case).surface
    lines, direction = anatomy.fibres_of(case, surface, lambda _: pytest.fail("it was meshed"))
    places = np.random.default_rng(1).uniform((2, 2, 5), (8, 8, 35), (40, 3))
    along = direction(np.zeros(len(places), int), places)
    lean = np.radians(25)
    assert np.abs(along @ [np.sin(lean), 0, np.cos(lean)]) == pytest.approx(1, abs=1e-6)
    assert lines.points.min(axis=0).min() >= -1e-9
    assert (lines.points.max(axis=0) <= np.array([10, 10, 40]) + 1e-9).all()


@pytest.mark.slow
@pytest.mark.parametrize("flux", ["area", None])
def test_fibres_of_a_spindle_cover_its_ends_either_way(flux: str | None) -> None:
    case = casefile.read_muscle("hip_flexion")
    assert case.fibres.traced is not None
    traced = case.fibres.traced.model_copy(update={"flux": flux})
    case = case.model_copy(update={"fibres": case.fibres.model_copy(update={"traced": traced})})
    rest = muscle.setup(case)
    lines, _ = anatomy.fibres_of(case, rest.surface, partial(muscle.filled, case, rest))
    ends = attached_ends(rest.attached, rest.exempt, lines)
    assert ends is not None
    assert ends.distance.max() < REACHES
    assert ends.covered.min() > 0.9


def test_a_tendon_goes_to_the_middle_of_its_landmarks(tmp_path: Path) -> None:
    (tmp_path / "landmarks.csv").write_text("cloud,landmark,x,y,z\nfoot,1,1,2,3\nhand,1,9,9,9\nfoot,2,3,4,8\n")
    cloud = {"file": "landmarks.csv", "unit": "cm", "cloud": "foot"}
    given = Attachment(name="end", bone="tibia", within="1 mm", tendon=cloud)
    without = Attachment(name="end", bone="tibia", within="1 mm")
    lost = Attachment(name="end", bone="tibia", within="1 mm", tendon=cloud | {"cloud": "head"})
    case = MuscleCase.model_construct(folder=tmp_path, place="case.toml", attachment=(given, without, lost))
    assert anatomy.tendon_of(case, 0) == pytest.approx([20, 30, 55])
    assert anatomy.tendon_of(case, 1) is None
    with pytest.raises(
        InputError, match=r'case.toml: attachment\[2\].tendon.cloud: got "head".*want one of foot, hand'
    ):
        anatomy.tendon_of(case, 2)


def test_fibres_by_area_of_a_case(bar) -> None:
    """Asked for by their key: a line through each of a few mm2, and the directions of the flow."""
    case = casefile.read_muscle(bar)
    assert case.fibres.traced is not None
    changes = {"start": "bottom", "end": "top", "flux": "area"}
    traced = case.fibres.traced.model_copy(update=changes)
    case = case.model_copy(update={"fibres": case.fibres.model_copy(update={"traced": traced})})
    box = shapes.box((2, 2, 6), (10.0, 10.0, 40.0))
    lines, direction = anatomy.fibres_of(case, shapes.skin(box), lambda _: box)
    assert len(lines.lengths()) == traced.count
    assert lines.lengths() == pytest.approx(40, rel=1e-9)
    assert direction(np.zeros(1, int), np.array([[3.0, 4, 11]])) == pytest.approx(np.array([[0.0, 0, 1]]), abs=1e-9)


def test_traced_fibres_of_a_straight_bar_go_straight_along_it(bar) -> None:
    """The field of a box between its two ends is linear: every line is as long as the box, and there is one direction."""
    sizes = []

    def fill(size: float) -> TetMesh:
        sizes.append(size)
        return shapes.box((2, 2, 6), (10.0, 10.0, 40.0))

    case = casefile.read(bar)
    traced = case.fibres.traced.model_copy(update={"start": "bottom", "end": "top"})
    case = case.model_copy(update={"fibres": case.fibres.model_copy(update={"traced": traced})})
    surface = shapes.skin(shapes.box((2, 2, 6), (10.0, 10.0, 40.0)))
    lines, direction = anatomy.fibres_of(case, surface, fill)
    (size,) = sizes
    assert size**3 / (6 * np.sqrt(2)) == pytest.approx(4000 / anatomy.TETS, rel=1e-9), (
        "the volume of a regular tetrahedron"
    )
    assert len(lines.lengths()) == case.fibres.traced.count
    assert lines.lengths() == pytest.approx(40, rel=1e-2)
    places = np.zeros(2, int), np.array([[5.0, 5, 20], [3, 4, 11]])
    assert direction(*places) == pytest.approx(np.tile([0.0, 0, 1], (2, 1)), abs=1e-6)
    turned = FibreTurn(axis=(-2, 0, 0), angle="30 deg")  # right-handed: z goes to y
    leaning = case.model_copy(update={"fibres": case.fibres.model_copy(update={"turned": turned})})
    same, direction = anatomy.fibres_of(leaning, surface, fill)
    assert np.array_equal(same.points, lines.points), "what is measured stays"
    assert direction(*places) == pytest.approx(np.tile([0.0, 0.5, np.sqrt(0.75)], (2, 1)), abs=1e-6)
    along = np.array([0, 0, 1.0])
    assert (anatomy.lean(case, along), anatomy.lean(leaning, along)) == (0, pytest.approx(np.sin(np.radians(60))))


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [0, 15])
def test_a_template_is_a_source_of_fibres(bar, degrees: int) -> None:
    """Parallel and pennate lines of a bar, whose directions are those of the case; they lean by the closed form."""
    asked = {
        "count": 5,
        "start": "bottom",
        "end": "top",
        "contours": 10,
        "template": "pennate" if degrees else "parallel",
    }
    inclined = {"pennation": f"{degrees} deg", "towards": (1, 0, 0)} if degrees else {}
    case = casefile.read(bar).model_copy(update={"fibres": Fibres(kohout_kukacka={**asked, **inclined})})
    box = shapes.box((3, 3, 8), (10.0, 10.0, 40.0))
    lines, directions = anatomy.fibres_of(case, shapes.skin(box), lambda _: box)
    along = directions(np.zeros(1, int), np.array([[5.0, 5.0, 20.0]]))[0]
    assert np.degrees(np.arctan2(along[0], along[2])) == pytest.approx(degrees, abs=0.1)
    assert len(lines) == 5
    assert anatomy.lean(case, np.array([0, 0, 1.0])) == pytest.approx(np.sin(np.radians(2 * degrees)))


def test_fibres_between_those_in_files_are_a_source(bar) -> None:
    """Between four straight lines along the edges of the bar, no mesh is made, and nothing leans."""
    edges = [np.array([[x, y, z] for z in (0.0, 20.0, 40.0)]) for x, y in ((1, 1), (9, 1), (9, 8), (1, 9))]
    files.write_polylines(
        bar / "edges.vtp", lines := Polylines(np.concatenate(edges), np.array([0, 3, 6, 9, 12])), lines.points
    )
    chmd = {"count": 6, "heads": ({"file": "edges.vtp", "unit": "mm"},)}
    case = casefile.read(bar).model_copy(update={"fibres": Fibres(chmd=chmd)})
    surface = shapes.skin(shapes.box((3, 3, 8), (10.0, 10.0, 40.0)))
    found, _ = anatomy.fibres_of(case, surface, lambda _: pytest.fail("it was meshed"))
    assert found.lengths() == pytest.approx(np.full(6, 40.0))
    assert anatomy.lean(case, np.array([0, 0, 1.0])) == pytest.approx(0, abs=1e-9)


def test_fibres_between_the_outermost_of_a_field_are_a_source(bar) -> None:
    """In a bar they are straight, as long as it is, and lean nowhere; by either flux."""
    box = shapes.box((3, 3, 8), (10.0, 10.0, 40.0))
    for flux in (None, "area"):
        around = {"count": 8, "start": "bottom", "end": "top", "flux": flux}
        case = casefile.read(bar).model_copy(update={"fibres": Fibres(chmd={"count": 6, "around": around})})
        found, _ = anatomy.fibres_of(case, shapes.skin(box), lambda _: box)
        assert found.lengths() == pytest.approx(np.full(6, 40.0))
        assert np.ptp(found.points[:, :2]) > 4
        assert anatomy.lean(case, np.array([0, 0, 1.0])) == 0


BALL = shapes.sphere(3, 30.0)
ANGLES = np.linspace(0, 2 * np.pi, 9)[:-1]
LANDMARKS = 10 * np.column_stack([np.cos(ANGLES), np.sin(ANGLES), np.zeros(8)])


def test_a_fan_covers_the_polygon_of_its_points_in_any_order() -> None:
    order = np.random.default_rng(0).permutation(8)
    patch = fan(LANDMARKS[order] @ np.linalg.qr(np.arange(9.0).reshape(3, 3) + np.eye(3))[0] + [5, 6, 7])
    assert len(patch.triangles) == 8
    assert triangle_areas(patch.points, patch.triangles).sum() == pytest.approx(8 * 50 * np.sin(np.pi / 4))


def test_a_patch_lies_on_the_bone_in_small_triangles() -> None:
    patch = draped(fan(LANDMARKS + [0, 0, 25]), BALL)
    assert distances(patch.points, BALL).distance.max() < 1e-9
    assert edge_lengths(patch.points[patch.triangles]).max() < 3
    # The cap of a sphere of 30 mm within 10 mm of its axis, and a little less of a polygon.
    cap = 2 * np.pi * 30 * (30 - np.sqrt(30**2 - 10**2))
    assert triangle_areas(patch.points, patch.triangles).sum() == pytest.approx(cap, rel=0.2)


@pytest.mark.parametrize(("far", "apart"), [(1e6, r"1e\+06"), (1e200, "inf")])
def test_landmarks_a_kilometre_apart_are_refused(far: float, apart: str) -> None:
    points = np.array([[0, 0, 0], [30, 0, 0], [0, 30, 0], [far, 0, 0.0]])
    with pytest.raises(InputError, match=rf"got landmarks {apart} mm apart, want landmarks around one attachment"):
        draped(fan(points), BALL)
