"""Sources of fibres in a scene file: one of them, with the keys that belong together."""

from pathlib import Path

import pytest

from tests.scenes.bars import changed, refused

PARALLEL = {"count": 5, "start": "start", "end": "end", "contours": 20, "template": "parallel"}
PENNATE = {**PARALLEL, "template": "pennate", "pennation": "20 deg", "towards": [1, 0, 0]}

REFUSED = [
    ({**PARALLEL, "contours": 3}, "contours: got 3, want greater than or equal to 4"),
    ({**PARALLEL, "count": 0}, "count: got 0, want greater than 0"),
    ({**PARALLEL, "template": "fan"}, "template"),
    ({**PARALLEL, "pennation": "20 deg"}, 'no "pennation" with "parallel"'),
    ({**PENNATE, "pennation": "70 deg"}, '"pennation" above 0 and up to 60 degrees'),
    ({**PENNATE, "towards": [0, 0, 0]}, '"towards" that is not zero'),
    ({key: value for key, value in PENNATE.items() if key != "towards"}, '"pennation" and "towards"'),
    ({**PARALLEL, "start": "middle"}, 'fibres.kohout_kukacka.start: got "middle", want one of start, end'),
]


def test_templates_are_read(bar: Path) -> None:
    case = changed(bar, "fibres", {"kohout_kukacka": PENNATE})
    assert case.fibres.kohout_kukacka.pennation == pytest.approx(0.349066, rel=1e-5)
    assert list(case.fibres.ends.values()) == ["start", "end"]


@pytest.mark.parametrize(("source", "message"), REFUSED)
def test_templates_that_cannot_be_are_refused(bar: Path, source: dict, message: str) -> None:
    refused(bar, "fibres", {"kohout_kukacka": source}, message)


def test_the_flux_of_traced_fibres_is_by_area_or_not_given(bar: Path) -> None:
    traced = {"count": 4, "start": "start", "end": "end"}
    for flux in ({}, {"flux": "area"}):
        given = changed(bar, "fibres", {"traced": traced | flux}).fibres.traced
        assert given is not None
        assert given.flux == flux.get("flux")
    refused(bar, "fibres", {"traced": traced | {"flux": "volume"}}, "fibres.traced.flux: got")


def test_there_is_one_source(bar: Path) -> None:
    refused(
        bar,
        "fibres",
        {"kohout_kukacka": PARALLEL, "traced": {"count": 1, "start": "start", "end": "end"}},
        "exactly one of",
    )


def test_heads_are_needed(bar: Path) -> None:
    refused(bar, "fibres", {"chmd": {"count": 3, "heads": []}}, "heads")


def test_fibres_on_the_surface_are_of_files_or_of_a_field_between_attachments(bar: Path) -> None:
    around = {"count": 12, "start": "start", "end": "end"}
    ends = changed(bar, "fibres", {"chmd": {"count": 3, "around": around}}).fibres.ends
    assert ends == {"fibres.chmd.around.start": "start", "fibres.chmd.around.end": "end"}
    refused(bar, "fibres", {"chmd": {"count": 3}}, 'exactly one of "heads" and "around"')
    refused(bar, "fibres", {"chmd": {"count": 3, "around": around | {"end": "nowhere"}}}, "nowhere")
