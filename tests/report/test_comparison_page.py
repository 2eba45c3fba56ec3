"""The page of a comparison shows all of it and opens without a network."""

import re
from dataclasses import replace

import numpy as np
import pytest

from fem_reference import report
from fem_reference.runs.store import Outcome
from fem_reference.scenes import casefile
from tests.report.comparisons import NAN, NUMBERS, alone, ball, html, measured, with_bars


@pytest.mark.slow
def test_page_names_everything_and_needs_no_network(comparison, tmp_path):
    text = report.write(report.of_comparison(comparison), tmp_path / "new" / "out", report.NAME).read_text(
        encoding="utf-8"
    )
    for printed in ("quick", "torn", "press", "torn has ended", "dolfinx", "<td>234</td>"):
        assert printed in text
    assert "0.500&#8239;" in text
    assert "It is &lt;nearly&gt; incompressible &amp; closed." in text
    assert '<span class="bad">not a number</span>' in text
    assert all(f"<td>{frame}</td>" in text for frame in NUMBERS)
    assert re.findall(r"<script.*?>", text) == [
        '<script type="application/json" id="page-facts">',
        '<script type="application/json" id="viewer-data">',
        '<script type="module">',
        "<script>",
    ]
    bare = re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL)
    links = re.findall(r'\b(?:src|href|action|data|srcset)\s*=\s*["\']?([^"\'\s>]*)', bare)
    assert all(link.startswith(("#", "data:")) for link in links)
    assert not re.search(r"<script|<link|<iframe|@import|url\((?!#)|http(?!-equiv)", bare)


@pytest.mark.slow
def test_every_id_on_the_page_is_unique_and_every_reference_meets_one(comparison):
    text = html(comparison)
    ids = re.findall(r'\bid="([^"]*)"', text)
    assert len(ids) == len(set(ids))
    assert set(re.findall(r'(?:href="|url\()#([^")]*)', text)) <= set(ids)


def test_reference_without_candidates_has_the_same_page(comparison, tmp_path):
    text = report.write(report.of_comparison(alone(comparison)), tmp_path, report.NAME).read_text(encoding="utf-8")
    assert "without a candidate" in text
    assert "quick" not in text
    assert {row["candidate"] for row in report.summary(alone(comparison))["measures"]} == {"reference"}


@pytest.mark.slow
@pytest.mark.usefixtures("without_curves")
def test_how_well_the_reference_is_known_is_reported(comparison):
    assert "With <code>--error-bar</code> the reference is also solved" in html(comparison)
    text = html(with_bars(comparison))
    # The bands of the model stand beside the numerical bars of what is in the headline, and without bars too.
    for whole in (text, html(comparison)):
        assert "<b>Surface</b>: 1.70 to 5.20&#8239;mm (finite element muscles of the hip against MRI" in whole
        assert "<b>Volume</b>: 2 to 6&#8239;%" in whole
        assert "<b>Fibre length</b>: no band is known" in whole
    assert "(4 mm instead of 2 mm)" in text
    assert "order 1.50 in general" in text
    names = ", ".join(attachment.name for attachment in comparison.scene.attachment)
    assert f"Along the rims of {names}, where" in text
    assert (
        "The last column is the change of a statistic with another model of the attachments: with exact attachments"
        in text
    )
    assert "source of error halved at a time (load steps)" in text
    assert "--error-bar" not in text
    # The worst frame of "quick" is the last, where the bar is not known; that of "torn" is the one before.
    assert '<small>± <span class="bad">not a number</span>' in text
    assert text.count("<th>another model</th>") == 2
    rows = report.summary(with_bars(comparison))["error_bars"]
    found = [row for row in rows if (row["of"], row["metric"], row["statistic"]) == ("change", "volume", "deviation")]
    assert [row["value"] for row in found] == [
        0,
        pytest.approx(1 / 70),
        pytest.approx(2 / 70),
        pytest.approx(3 / 70),
        None,
    ]
    assert [row["frame"] for row in found] == list(comparison.reference.numbers)
    assert (found[1]["model"], found[1]["unit"]) == (pytest.approx(3 / 70), "%")


@pytest.mark.slow
@pytest.mark.usefixtures("without_curves")
def test_candidates_are_ranked_where_the_reference_is_known(comparison):
    assert "Ranking by deviation" not in html(comparison)
    known = with_bars(comparison)
    assert "Ranking by deviation" in html(known)
    ranked = report.summary(known)["rankings"]
    assert {row["name"] for row in ranked} == {run.name for run in comparison.candidates}
    # "torn" has no number in its last frame: it comes last, whatever is known.
    assert [row["rank"] for row in ranked if row["by"] == "Surface, rms"] == [[1, 1], [2, 2]]


@pytest.mark.slow
@pytest.mark.usefixtures("without_curves")
def test_a_scene_that_differs_from_its_file_is_reported(comparison):
    damaged = replace(comparison, scene=casefile.read(comparison.scene.place, with_negative_control=True))
    assert "effect[0].mu" not in re.sub(r"<pre>.*</pre>", "", html(comparison), flags=re.DOTALL)
    assert "<th>effect[0].mu</th><td>0.01 in the file, 0.001 here</td>" in html(damaged)


@pytest.mark.slow
@pytest.mark.usefixtures("without_curves")
def test_a_reference_turned_inside_out_is_reported(comparison):
    assert "inside out. At" not in html(alone(comparison))
    scalars = {"min_det_F_points": np.array([1, 0.5, -0.25, 0.5, NAN])}
    turned = replace(alone(comparison), reference=replace(comparison.reference, scalars=scalars))
    assert re.search(r"at points falls to \N{MINUS SIGN}0.250: there the reference is turned", html(turned))


@pytest.mark.slow
@pytest.mark.usefixtures("without_curves")
def test_a_reference_that_is_unstable_is_reported(comparison):
    def rendered(modes):
        scalars = {"negative_modes": np.array(modes)}
        return html(replace(alone(comparison), reference=replace(comparison.reference, scalars=scalars)))

    assert "unstable equilibrium" not in html(alone(comparison)) + rendered([0, 0, 0, NAN, 0])
    assert re.search(
        r"unstable equilibrium at 2 of . frames: its energy falls in\s+up to 3 dir", rendered([0, 1, 3, NAN, 0])
    )


@pytest.mark.slow
@pytest.mark.usefixtures("without_curves")
def test_effects_are_reported_with_their_units(comparison):
    assert comparison.scene.effects[0].parameters == [("mu", 0.01, "MPa")]
    assert "<tr><th>NeoHooke</th><td>mu = 0.01 MPa</td></tr>" in html(comparison)


@pytest.mark.slow
@pytest.mark.usefixtures("without_curves")
def test_of_a_reference_that_failed_the_frames_that_it_reached_are_shown(comparison):
    positions = np.array(comparison.reference.positions)
    positions[3:] = NAN
    lost = Outcome("diverged", "no equilibrium near the foot; try smaller steps", {"seconds": 1.0})
    failed = replace(comparison.reference, positions=positions, outcome=lost)
    quick = replace(comparison.candidates[0], name="quick")
    deviations, changes = (
        {"quick": measured(quick, positions)},
        {"reference": measured(failed, ball().points), "quick": measured(quick, ball().points)},
    )
    one = replace(comparison, reference=failed, candidates=(quick,), deviations=deviations, changes=changes)
    assert "3 of 5 frames were reached, up to frame 20" in html(with_bars(one))
    text = re.sub(r"<script.*?</script>", "", html(one), flags=re.DOTALL)
    assert "The reference (fenicsx): diverged.</b> no equilibrium near the foot; try smaller steps. 3 of 5 " in text
    top = re.search(r"<tr><th>reference</th>.*?</tr>", text, re.DOTALL)[0]
    assert '<span class="badge fail">fail</span>' in top
    assert "1 of 1 expectations met; diverged" in top
    assert "not a number" not in text
    assert "frame 40" not in text.replace("from frame 0", "")
    unmet = replace(one.verdicts[0], word="fail", value=NAN, frame=30)
    text = re.sub(r"<script.*?</script>", "", html(replace(one, verdicts=(unmet,))), flags=re.DOTALL)
    assert "not a number" not in text
    assert "<td>not reached" in text
    nowhere = replace(failed, positions=np.full_like(positions, NAN))
    apart = {"quick": measured(quick, nowhere.positions)}
    text = html(replace(one, reference=nowhere, deviations=apart))
    assert "No frame was reached, so nothing could be compared with it." in text
    assert "Deviations at their worst frames" not in text
    assert "not a number" not in re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL)
    assert "<h2>Cost</h2>" in text
    assert 'type="module"' not in text


@pytest.mark.slow
def test_what_each_frame_of_the_reference_took_is_shown_where_it_is_known(comparison):
    seconds = {"seconds_processor": np.arange(5.0), "contact_points": np.array([0.0, 0, 17, 0, NAN])}
    known = replace(alone(comparison), reference=replace(comparison.reference, scalars=seconds))
    text = html(known)
    assert "Processor time of the reference for each frame" in text
    assert re.search(r"<th>Frame</th><th>processor time \[s\]</th><th>points in contact</th>", text)
    assert "<td>17</td>" in text
    assert "Processor time of the reference" not in html(alone(comparison))
