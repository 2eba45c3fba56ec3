"""Regions of a case and of a body: the kinds of borders, their sizes in words, and what leaves a part of the body without a law."""

from dataclasses import replace

import numpy as np
import pytest
import shapes
import small

import fem_reference as fr
from fem_reference.effects import make
from fem_reference.foundations.errors import InputError
from fem_reference.io import files
from fem_reference.problems import muscle, of_case, regions
from fem_reference.problems.body import Body
from fem_reference.scenes import casefile

AT_END = {"name": "tendon", "width": "2 mm", "attachment": {"name": "origin", "length": "8 mm"}}
SOFT, STIFF = (
    {"name": "neo_hooke", "mu": mu, "in": place} for mu, place in (("1 kPa", "not tendon"), ("1 MPa", "tendon"))
)
VOLUME = {"name": "incompressible", "bulk": "10 MPa"}


def bar(tmp_path, *tables, effects=(SOFT, STIFF, VOLUME)):
    """The small bar of 10 x 10 x 40 mm along z, attached at z = 0 ("origin") and 40, with regions."""
    folder = small.write(tmp_path / "bar")
    skin = shapes.skin(shapes.box((1, 1, 1), (12.0, 12.0, 8.0)))
    files.write_surface(folder / "end.ply", skin, skin.points - [1, 1, 0])
    files.write_surface(
        folder / "sheet.ply",
        replace(skin, triangles=skin.triangles[(skin.points[skin.triangles, 2] == 0).all(axis=1)]),
        skin.points - [1, 1, 0],
    )
    return casefile.read_muscle(folder, changes={"region": list(tables), "effect": list(effects)})


FIELD = {"start": "origin", "end": "insertion", "first": 0.0, "last": 0.5}
EACH = {
    "attachment": {"name": "origin", "length": "8 mm"},
    "patch": {"file": "sheet.ply", "unit": "mm", "depth": "8 mm"},
}


@pytest.mark.parametrize("kind", EACH)
def test_the_same_end_of_a_bar_by_each_kind_of_border(tmp_path, kind) -> None:
    rest = muscle.setup(bar(tmp_path, {"name": "tendon", "width": "2 mm", kind: EACH[kind]}))
    z = np.linspace(0.5, 39, 50)
    shares = rest.regions["tendon"](np.column_stack([np.full(50, 5.0), np.full(50, 4.0), z]))
    assert shares == pytest.approx((1000 ** np.clip((8 - z) / 2, 0, 1) - 1) / 999, abs=1e-6)


def test_half_of_the_field_is_half_of_a_symmetric_bar(tmp_path) -> None:
    rest = muscle.setup(bar(tmp_path, {"name": "tendon", "width": "0 mm", "field": FIELD}))
    z = np.array([0.0, 10, 19, 21, 30, 40])
    assert rest.regions["tendon"](np.column_stack([np.full(6, 5.0), np.full(6, 5.0), z])).tolist() == [1, 1, 1, 0, 0, 0]


def test_inside_of_a_closed_surface_and_not_of_an_open_one(tmp_path) -> None:
    inside = {"name": "tendon", "width": "0 mm", "surface": {"file": "end.ply", "unit": "mm"}}
    rest = muscle.setup(bar(tmp_path, inside))
    assert rest.regions["tendon"](np.array([[5.0, 5, 7.9], [5, 5, 8.1]])).tolist() == [1, 0]
    inside["surface"]["file"] = "sheet.ply"
    with pytest.raises(InputError, match=r"region\[0\]\.surface\.file.*want a closed surface"):
        muscle.setup(bar(tmp_path, inside))


@pytest.mark.parametrize("suffix", ["vtu", "msh"])
def test_tetrahedra_of_a_label_are_a_region(tmp_path, suffix) -> None:
    """Those below 8 mm of a box beside the bar, of which the file has the labels; a label or array that it has not is refused."""
    scene = bar(tmp_path, AT_END)
    mesh = shapes.box((3, 3, 5), (14.0, 14.0, 20.0))
    labels = np.where(mesh.points[mesh.tets].mean(axis=1)[:, 2] < 8, 7, 1)
    files.write_field(scene.folder / f"parts.{suffix}", mesh.points - [2, 2, 0], mesh.tets, {}, {"part": labels})
    table = {"file": f"parts.{suffix}", "unit": "mm", "array": "part", "labels": [7, 9]}

    def of(changes):
        tendon = {"name": "tendon", "width": "0 mm", "tets": table | changes}
        return muscle.setup(bar(tmp_path, tendon)).regions["tendon"](
            np.array([[5.0, 5, 7.9], [5, 5, 8.1], [5, 5, 0.1]])
        )

    assert of({}).tolist() == [1, 0, 1]
    for changes, message in (
        ({"labels": [3]}, "got no tetrahedra with these labels"),
        ({"array": "region"}, 'an array "region" of integers'),
    ):
        with pytest.raises(InputError, match=rf"parts\.{suffix}.*{message}"):
            of(changes)


@pytest.mark.slow
def test_regions_of_one_name_are_one_and_sizes_and_overlaps_are_stated(tmp_path) -> None:
    other = AT_END | {"attachment": {"name": "insertion", "length": "10 mm"}, "width": "0 mm"}
    fat = {"name": "fat", "width": "0 mm", "surface": {"file": "end.ply", "unit": "mm"}}
    scene = bar(tmp_path, AT_END | {"width": "0 mm"}, other, fat)
    rest = muscle.setup(scene)
    found = of_case.known(scene, rest)["regions"]
    assert found == of_case.facts(scene, rest)["regions"]
    sizes = {name: float(text.partition(" %")[0]) for name, text in found.items()}
    z = np.linspace(0, 40, 4001)
    areas = (1 + 0.3 * np.sin(np.pi * z / 40)) ** 2
    low, high = (100 * areas[some].sum() / areas.sum() for some in (z <= 8, z >= 30))
    assert sizes == pytest.approx(
        {"tendon": low + high, "fat": low, "tendon and fat overlap in": low}, abs=2
    )  # bulging sides are farther


def test_what_a_case_says_of_regions_is_checked(tmp_path) -> None:
    unknown = {"name": "neo_hooke", "mu": "1 kPa", "in": "fat"}
    for tables, effects, message in (
        ([AT_END], (unknown, VOLUME), r'effect\[0\]\.in: got "fat", want one of tendon'),
        ([], (SOFT, VOLUME), r'effect\[0\]\.in: got "tendon", want none, as none is defined'),
        (
            [AT_END | {"attachment": {"name": "top", "length": "8 mm"}}],
            (VOLUME,),
            r"region\[0\]\.attachment\.name: got .top",
        ),
        ([AT_END | {"name": "not me"}], (VOLUME,), r"region\[0\]\.name: got .*does not begin with .not "),
        ([AT_END | {"width": "-1 mm"}], (VOLUME,), r"region\[0\]\.width: got .*want greater than or equal to 0"),
        ([AT_END | {"field": FIELD}], (VOLUME,), r"region\[0\]: got .*exactly one of"),
        ([AT_END], (SOFT, SOFT, VOLUME), r'effect\[1\]\.name: got "neo_hooke" in "not tendon" a second time'),
        ([AT_END], (SOFT, STIFF, VOLUME | {"bulk": "10 kPa"}), r"at least the shear modulus"),
    ):
        with pytest.raises(InputError, match=message):
            bar(tmp_path, *tables, effects=effects)


def test_a_bulk_modulus_is_compared_with_the_laws_beside_it(tmp_path) -> None:
    """1 MPa resists change of shape in the tendon alone: the belly may have a bulk modulus below it."""
    each = [VOLUME | {"bulk": bulk, "in": place} for bulk, place in (("100 kPa", "not tendon"), ("1 GPa", "tendon"))]
    scene = bar(tmp_path, AT_END, effects=(SOFT, STIFF, *each))
    assert [*scene.acting] == [
        f"{law} in {place}" for law in ("NeoHooke", "Incompressible") for place in ("not tendon", "tendon")
    ]


# Bodies


def end(z: float):
    """All below a height, without a transition."""
    return lambda points: np.where(points[:, 2] <= z, 1.0, 0.0)


def laws(*given) -> tuple:
    return tuple(make(name, **({"in": place} | parameters)) for name, place, parameters in given)


MATRIX, BULK = {"mu": 0.01}, {"bulk": 10.0}
WHOLE = (("neo_hooke", "not tendon", MATRIX), ("neo_hooke", "tendon", MATRIX), ("incompressible_penalty", "", BULK))
BODY = Body(
    fr.box((2, 2, 4), (1.0, 1.0, 2.0), "tetrahedron"), laws(*WHOLE), (), (0.0, 1.0), regions={"tendon": end(0.5)}
)


@pytest.mark.parametrize(
    ("effects", "region", "message"),
    [
        (
            WHOLE[1:],
            end(0.5),
            r"isochoric laws \(NeoHooke in tendon\) with a share of 0 at .*want at least 0.5 everywhere",
        ),
        (
            WHOLE[:2] + (("incompressible_penalty", "tendon", BULK),),
            end(0.5),
            r"volumetric laws .* with a share of 0 at",
        ),
        (
            WHOLE[:2] + (("incompressible", "", BULK), ("incompressible", "tendon", BULK)),
            end(0.5),
            "pressure laws .* 2 at",
        ),
        (WHOLE[:2] + (("incompressible", "tendon", BULK),), end(0.5), "pressure laws .* with a share of 0 at"),
        (WHOLE, end(-1), r'effects\[1\]\.in: got "tendon", which is nowhere in the body'),
        (
            WHOLE,
            lambda points: 0.1 + 0 * points[:, 2],
            r'effects\[1\]\.in: got "tendon", whose share is at most 0.1, want a share of 0.25',
        ),
        (
            (*WHOLE, ("membrane", "tendon", {"on": "z0", "thickness": 0.1, "mu": 1.0})),
            lambda points: np.where(np.abs(points[:, 2] - 1) < 0.9, 1.0, 0.0),
            r'effects\[3\]\.in: got "tendon", which is nowhere in the body',
        ),
        (WHOLE, end(9), r'effects\[0\]\.in: got "not tendon", which is nowhere in the body'),
        (WHOLE, lambda points: points[:, 2], "regions: .*tendon: got shares from .* want from 0 to 1"),
        (WHOLE, lambda points: points[:, 2] * np.nan, "regions: .*tendon: got shares from nan"),
        ((("neo_hooke", "fat", MATRIX),), end(1), r'effects\[0\]\.in: got "fat", want a region of the body: tendon'),
    ],
)
def test_no_part_of_a_body_is_without_a_law(effects, region, message) -> None:
    with pytest.raises(InputError, match=message):
        regions.check(replace(BODY, effects=laws(*effects), regions={"tendon": region}))


def test_a_body_with_laws_everywhere_is_as_it_should_be() -> None:
    regions.check(BODY)
    regions.check(
        replace(
            BODY, effects=laws(*WHOLE[:2], ("incompressible", "tendon", BULK), ("incompressible", "not tendon", BULK))
        )
    )
    regions.check(
        replace(
            BODY,
            effects=laws(
                ("neo_hooke", "", MATRIX),
                (
                    "fibre_passive",
                    "tendon",
                    {"stress": 0.3, "p1": 0.05, "p2": 6.6, "optimal_stretch": 1.0, "linear_from": 1.4},
                ),
            ),
        )
    )


def test_inertia_is_of_the_whole_body() -> None:
    with pytest.raises(InputError, match="no region, as the entire body has inertia"):
        make("inertia", density=1e-9, **{"in": "tendon"})
