"""The page over the kinds of solvers: what is not a number, units of its axes, and references that failed."""

import json
import math
import re
from dataclasses import replace

from fem_reference import report
from fem_reference.report import ranking_page
from fem_reference.runs.store import Outcome
from tests.studies.test_table_5_1 import solver_result, table


def test_what_is_not_a_number_stands_on_the_page_and_not_in_the_drawing() -> None:
    lost = replace(solver_result("case0", math.nan), outcome=Outcome("diverged", "lost at <frame> 3"))
    made = table(lost, solver_result("case1", 5.0, seconds=None))
    html = ranking_page.page(made).html()
    assert "not a number" in html
    assert "lost at &lt;frame&gt; 3" in html
    json.dumps(ranking_page.facts(made), allow_nan=False)


def test_times_are_drawn_in_the_unit_that_their_axis_names() -> None:
    made = table(solver_result("case0", 3.0, seconds=0.02), solver_result("case1", 4.0, seconds=0.05))
    html = ranking_page.page(made).html()
    drawing = re.search("<svg.*?</svg>", html, re.DOTALL)
    assert drawing is not None
    texts = re.findall(r"<text[^>]*>([^<]*)<", drawing[0])
    assert texts[:3] == ["20", "50", "time for a frame number, ms"]  # 0.02 and 0.05 s
    assert "<td>50<small>20 ms</small>" in html  # frames in a second


def test_of_a_reference_that_failed_one_sentence_stands_there_and_no_table() -> None:
    made = table(solver_result("case0", math.nan), solver_result("case1", 2.0))
    lost = replace(made.scenarios[0], reference=Outcome("diverged", "No equilibrium; try smaller steps."))
    html = ranking_page.page(replace(made, scenarios=(lost, made.scenarios[1]))).html()
    part = html[html.index('<h2 id="case0">') : html.index('<h2 id="case1">')]
    assert "<b>The reference: diverged.</b> No equilibrium; try smaller steps. Nothing could be measured" in part
    assert "<table" not in part
    assert "<table" in html[html.index('<h2 id="case1">') :]


def test_the_page_is_whole_or_not_there(tmp_path) -> None:
    path = report.write(ranking_page.page(table(solver_result("case0", 1.0))), tmp_path / "new", "table-5-1")
    assert sorted(file.name for file in path.parent.iterdir()) == ["table-5-1.html", "table-5-1.json"]
