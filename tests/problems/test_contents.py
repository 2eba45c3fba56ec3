"""The contents of a case in words and numbers."""

import fields

from fem_reference.problems import contents, muscle
from fem_reference.problems.scalar import build
from fem_reference.report.overview import case_facts
from fem_reference.scenes import casefile


def test_show_says_what_bones_are_and_how_they_move(squeezed, bar) -> None:
    facts = case_facts(squeezed, muscle.setup(squeezed))
    assert facts["muscle"]["mesher"] == "block"
    assert facts["attachments"] == {}
    assert facts["bones"] == {
        "floor": "half space of point (0, 10, 0), normal (0, 1, 0), mm, rests",
        "lid": "box of centre (0, 140, 0), size (400, 100, 400), rounding 0, mm, slides along (0, -1, 0), "
        "mm at frame: 0 at 0, 40 at 100",
    }
    turning = casefile.read(bar)
    assert "turns about (5, 5, 30) mm along" in case_facts(turning, muscle.setup(turning))["bones"]["lid"]


def test_a_muscle_has_its_volume_the_areas_of_its_ends_and_its_effects(bar) -> None:
    case = casefile.read(bar)
    rest = muscle.setup(case)
    facts = contents.of_muscle(rest, case)
    assert facts["muscle"]["triangles"] == len(rest.surface.triangles)
    assert facts["muscle"]["tet_size_mm"] == 6
    for name, bone in (("origin", "floor"), ("insertion", "lid")):
        # Ends are squares of 10 mm.
        assert facts["attachments"][name].endswith(f" vertices, 100 mm2, attached to {bone} exactly")
    assert facts["effects"] == {"NeoHooke": {"mu": "0.01 MPa"}, "Incompressible": {"bulk": "10 MPa"}}
    assert facts["frames"] == "0 to 20, every 5"


def test_springs_and_their_stiffness_are_said(bar) -> None:
    case = casefile.read(bar)
    soft = case.attachment[1].model_copy(update={"stiffness": 0.1})
    case = case.model_copy(update={"attachment": (case.attachment[0], soft)})
    said = contents.of_muscle(muscle.setup(case), case)["attachments"]
    assert said["insertion"].endswith("attached to lid by springs of 0.1 MPa/mm")
    assert said["origin"].endswith("attached to floor exactly")


def test_a_field_has_its_size_its_nodes_and_its_form(tmp_path) -> None:
    """A rod of 2 mm in 4 cells, fixed at one end; its mesh Peclet number is ``3 * 0.5 / (2 * 1)``."""
    case = fields.scene(
        tmp_path,
        domain={"interval": {"start": 0.0, "end": 2.0, "count": 5}},
        effect=[{"name": "diffusion", "coefficient": 1.0}, {"name": "advection", "velocity": [3.0]}],
        boundary=[{"on": "left", "value": 0}],
        element=fields.element(1),
    )
    facts = contents.of_field(build(case), case)
    assert facts["domain"] == "4 cells, 5 vertices, size 2"
    assert facts["element"] == "P1, 5 nodes, 1 fixed"
    assert facts["form"] == "galerkin, mesh Peclet number up to 0.75"
    assert facts["effects"]["Diffusion"]["coefficient"] == "1.0"
    assert set(facts["effects"]) == {"Diffusion", "Advection"}
