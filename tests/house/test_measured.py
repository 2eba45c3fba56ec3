"""Tables of measurements on the pages: they are those of the files that are kept, and each file says where it is from."""

import json
import re

import drawn_results
import example_pictures
import measured
import measurements
import pages
import pytest

from fem_reference.assessment import credibility, experiments


def test_the_pages_have_the_tables_that_are_kept() -> None:
    assert measured.write_pages(check=True) == []


def test_every_table_has_its_place() -> None:
    places = re.findall(r"<!-- (?:measured|written): (\w+) -->", "".join(pages.page(name) for name in pages.PAGES))
    assert set(places) == set(measured.WRITTEN)


def test_the_error_bar_and_the_bands_side_by_side_are_those_of_their_sources() -> None:
    """Numerical bars and model bands of the evidence by quantity, and the greatest widths of the bands of two cases, rounded."""
    text = pages.page("docs/validation.md").partition("## One error bar and two bands\n")[2]
    numerical, parameters, models = (
        next(line for line in text.splitlines() if line.startswith(f"| **{name}"))
        for name in ("numer", "param", "model")
    )
    for one in credibility.claims():
        if one.name in ("Volume", "Fibre length", "Surface"):
            assert f"± {one.bar.removesuffix(' rms')}" in numerical
        if one.band:
            low, high = (fact.value for fact in experiments.model_band(one.band))
            assert f"{low:g} to {high:g} {experiments.model_band(one.band)[0].unit}" in models
    kept = [measurements.kept(name)["measured"]["bands"] for name in ("uncertainty", "uncertainty_iliacus")]
    first, second = ({one["quantity"]: one["width"] for one in bands} for bands in kept)
    for quantity in ("surface_deviation.rms", "fibre_length.mean"):
        assert f"{first[quantity]:.1f} and {second[quantity]:.1f} mm" in parameters
    assert f"{first['force on femur']:.0f} and {second['force on femur']:.2f} N" in parameters


@pytest.mark.parametrize("name", measurements.MEASUREMENTS)
def test_a_measurement_says_its_command_commit_date_and_machine(name) -> None:
    file = measurements.kept(name)
    assert file["command"] == measurements.MEASUREMENTS[name].command
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", file["date"])
    assert re.fullmatch(r"[0-9a-f]{7,}", file["commit"])
    assert file["machine"]


def test_what_is_kept_of_the_catalogue_passes() -> None:
    for entry in measurements.kept("verify")["measured"]:
        if entry["kind"] == "experiment":
            assert entry["verdict"] in ("within", "outside")
            continue
        assert entry["verdict"] == "pass"
        assert entry["error"] <= entry["within"], entry["name"]


def test_hard_cases_are_counted_and_the_ends_of_load_steps_are_read() -> None:
    """A sentence as ``studies.hard.following.in_steps`` writes it, with a number of load steps that ended with a status."""
    apart = "1: 1.5e-13 % of the body's size from the end state with 10 load steps"
    sentence = f"unstable; end state at frame 5 by number of load steps: {apart}, 40: out of steps"
    cells = [
        {"case": "twist", "solver": "fenicsx", "verdict": "ok", "sentence": sentence},
        {"case": "hip", "solver": "fenicsx", "verdict": "ok", "sentence": "volume 1 % at frame 3"},
        {"case": "twist", "solver": "pbd", "verdict": "failed", "sentence": ""},
    ]
    kept = measurements.MEASUREMENTS["stress"].keep({"solvers": ["fenicsx", "pbd"], "cells": cells})
    assert kept["counts"] == [{"solver": "fenicsx", "ok": 2}, {"solver": "pbd", "failed": 1}]
    assert kept["cases"] == ["twist", "hip"]
    assert kept["verdicts"] == [["ok", "failed"], ["ok", ""]]
    seen = drawn_results.hard_cases(kept).markup
    good, bad = (
        len(re.findall(rf"<use [^>]*var\({colour}\)", seen)) for colour in ("--good, #14713a", "--bad, #b3261e")
    )
    assert (good, bad) == (3, 2)  # a square for each cell, and one in the legend
    off = {"1": 1.5e-13, "40": "out of steps", "10": "finest"}
    assert kept["ends"] == [{"case": "twist", "verdict": "ok", "frame": 5, "off": off}]


def test_runs_on_other_meshes_are_read() -> None:
    """Sentences as ``studies.hard.following.on_meshes`` writes them; a case whose runs take too long has none."""
    ended = "7 converged, 2 out of steps, 1 denied, up to frame 12 to 20, apart by 3.1 % at most, 0.2 % in the median; unstable"
    found = {}
    for case, sentence in (
        ("one", f"ok; on other meshes: {ended}"),
        ("two", "ok; no runs on other meshes, as one takes more"),
    ):
        found[case] = {"cells": [{"case": case, "verdict": "ok", "status": "converged", "sentence": sentence}]}
    kept = measurements.MEASUREMENTS["stress_jitters"].keep(found)
    assert [one["meshes"] for one in kept] == [
        ("7 converged, 2 out of steps, 1 denied", "12 to 20", "3.1", "0.2"),
        None,
    ]


def test_arms_about_an_axis_are_those_of_the_reference_and_a_pose_that_was_not_reached_has_the_status(
    monkeypatch,
) -> None:
    """Arms of candidates are differences from those of the reference, and so are not arms."""
    values = {"mean": 2.0, "least": -1.0, "greatest": 4.0, "rms": 3.0}
    own = [
        {"candidate": who, "metric": "moment_arm", "statistic": name, "frame": frame, "value": value + frame + off}
        for who, off in (("reference", 0.0), ("pbd", 50.0))
        for name, value in values.items()
        for frame in (30, 50, 60)
    ]
    keep = measurements.MEASUREMENTS["arms_rotation"].keep
    kept = {"measured": keep({"hip": {"status": "diverged", "measures": own}})}
    monkeypatch.setattr(measurements.evidence, "kept", lambda _: kept)
    monkeypatch.setattr(measurements.tables, "origin", lambda _: "here")
    row = measurements.TABLES["arms_rotation"]().splitlines()[2]
    assert row == "| `hip` | 32.0 (29.0 to 34.0) | 62.0 (59.0 to 64.0) | diverged |"


def test_the_choice_of_fibres_has_bars_of_changes_and_of_the_fibres_as_shipped_alone(monkeypatch) -> None:
    """A deviation has another bar than a change, and other fibres belong to the second place of each cell."""
    arms = {"mean": 2.0, "least": -1.0, "greatest": 4.0}
    own = [("moment_arm", name, frame, value + frame) for name, value in arms.items() for frame in (0, 50)]
    own.append(("fibre_length", "mean", 50, -3.0))
    bars = [("fibre_length", "mean", 50, 0.5), ("moment_arm", "mean", 50, 0.25)]
    keys = ("metric", "statistic", "frame", "value")

    def run(length: float, off: float, own_bars: list[tuple[str, str, int, float]]) -> dict[str, object]:
        shown = [{"candidate": who, **dict(zip(keys, (*key, value + by), strict=True))}
                 for who, by in (("reference", off), ("pbd", 99.0)) for *key, value in own]  # fmt: skip
        known = [{"of": of, **dict(zip(keys, (*key, value + by), strict=True))}
                 for of, by in (("change", 0.0), ("deviation", 9.0)) for *key, value in own_bars]  # fmt: skip
        mesh = {"fibre_length_mean_mm": length}
        return {"status": "converged", "mesh": mesh, "measures": shown, "error_bars": known}

    first, other = measurements.MEASUREMENTS["fibre_choice"].cases[:2]
    assert first.startswith("hip_flexion --error-bar")
    keep = measurements.MEASUREMENTS["fibre_choice"].keep
    kept = {"measured": keep({first: run(180.0, 0.0, bars), other: run(190.0, 1.0, [])})}
    monkeypatch.setattr(measurements.fibres, "kept", lambda _: kept)
    monkeypatch.setattr(measurements.tables, "origin", lambda _: "here")
    row = measurements.TABLES["fibre_choice"]().splitlines()[2]
    cells = ("`hip_flexion`", "potential / by area", "180.0 / 190.0", "-3.0 ± 0.5 / -2.0")
    arms_shown = ("2.0 (-1.0 to 4.0) / 3.0 (0.0 to 5.0)", "52.0 ± 0.25 (49.0 to 54.0) / 53.0 (50.0 to 55.0)")
    assert row == "| " + " | ".join((*cells, *arms_shown)) + " |"


def test_every_solver_has_as_many_hard_cases() -> None:
    found = measurements.kept("stress")["measured"]
    assert len({sum(count for count in one.values() if isinstance(count, int)) for one in found["counts"]}) == 1
    assert len(found["ends"]) > 20


def test_every_picture_is_that_of_its_example() -> None:
    """Python docs/example_pictures.py makes them anew."""
    assert json.loads(example_pictures.FILE.read_text(encoding="utf-8")) == example_pictures.sources()
    drawn = {path.name: path.stat().st_size for path in example_pictures.KEPT.glob("*.webp")}
    assert set(drawn) == {example_pictures.picture(name).name for name in example_pictures.sources()}
    assert max(drawn.values()) < 30_000
