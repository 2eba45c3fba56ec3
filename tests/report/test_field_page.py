"""The page of scalar examples shows all of an example, opens without a network, and survives what is not a number."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import fields
import numpy as np
import pytest

from fem_reference.assessment.comparison import Comparison, Convergence
from fem_reference.assessment.judge import Verdict
from fem_reference.foundations.errors import InputError
from fem_reference.metrics import FieldContext, Measure
from fem_reference.problems import scalar as field_problem
from fem_reference.report import field_figures, field_page
from fem_reference.runs.store import Outcome, Run

pytestmark = pytest.mark.slow

NAN = float("nan")
DIFFUSION = {"name": "diffusion", "coefficient": 1.0}
SOURCE = {"name": "source", "strength": "-1", "where": "everywhere"}
LADDERS = (
    Convergence("P1", (8, 16, 32), (0.25, 0.0625, 0.015625), 2.25, "distance to <exact>"),
    Convergence("P2", (8, 16, 32), (0.125, NAN, 0.0), NAN, "rms at the coarsest vertices"),
)
VOID = {"meta", "img", "path", "use", "rect", "br"}


class Tags(HTMLParser):
    """Every tag that is opened is closed, in order; the text and attributes found."""

    def __init__(self):
        super().__init__()
        self.open, self.headings, self.sources = [], [], []

    def handle_starttag(self, tag, attrs):
        self.sources += [value for key, value in attrs if key in ("src", "href")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        self.handle_endtag(tag)

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in ("h1", "h2", "h3"):
            self.headings.append(data)


def read(text: str) -> Tags:
    tags = Tags()
    tags.feed(text)
    tags.close()
    assert tags.open == []
    return tags


def example_of(folder, values=None, **tables) -> Comparison:
    """The scene in ``folder`` with a reference of zeros at the vertices and the ``listing`` of ``values``, else also zeros."""
    folder.mkdir()
    tables = {"effect": [DIFFUSION, SOURCE], "boundary": ()} | tables
    if callable(tables["domain"]):
        tables["domain"] = tables["domain"](folder)
    scene = fields.scene(folder, **tables)
    problem = field_problem.build(scene)
    base = np.linspace(0.0, -2.0, len(problem.fixed))
    values = base if values is None else values(base)
    done = Outcome("converged", "done", {"seconds_assembly": 0.25, "seconds_solve": 0.5})
    reference = run_of("reference", "fenicsx", problem, base, done)
    listing = run_of("listing", "listing", problem, values, Outcome("converged", "as listed"), form="as listed")
    return Comparison(
        scene,
        problem,
        reference,
        (listing,),
        FieldContext(problem.exact),
        {"listing": (Measure("nodal_error", "max", "1", np.array([0.03125])),)},
        {"reference": (Measure("minimum", "value", "1", np.array([NAN])),)},
        None,
        (Verdict("pass", scene.expect[0], 0.375, 0.0, 0.5, "1", 0),),
        ladders=LADDERS,
    )


def run_of(name, solver, problem, values, outcome, **origin) -> Run:
    """A run of one frame with ``values`` at the nodes."""
    shown = {"has_surface": False, "mesh": problem.mesh, "fields": {"psi": values[None]}}
    return Run(name, solver, outcome, (0,), origin=origin, **shown)


def rod(folder, values=None, **tables) -> Comparison:
    fixed = {"boundary": [{"on": "left", "value": "0"}], "exact": "x**2/2 - 2*x"}
    interval = {"interval": {"start": 0.0, "end": 1.0, "count": 20, "seed": 1}}
    return example_of(folder, values, **({"domain": interval} | fixed | tables))


def plate(folder, values=None, **tables) -> Comparison:
    square = {"domain": lambda path: fields.square(path, 5), "boundary": [{"on": "rim", "value": "0"}]}
    return example_of(folder, values, **(square | tables))


def ball(folder, values=None) -> Comparison:
    (folder.parent / "bounds.csv").write_text("1,2\n0,0\n")
    bounds = [{"bounds": str(folder.parent / "bounds.csv")}]
    return example_of(folder, values, domain=lambda path: fields.sphere(path, 1), boundary=bounds)


def test_page_shows_everything_and_needs_no_network(tmp_path):
    examples = (
        rod(tmp_path / "rod"),
        plate(tmp_path / "other", lambda base: 3 * base),
        ball(tmp_path / "surface_figure"),
    )
    text = field_page.render("Three & <more>", examples, differences=True)
    tags = read(text)
    assert tags.headings.count("Runs") == tags.headings.count("Convergence") == 3
    assert tags.headings[0] == "Three & <more>"
    # The rod has two drawings; plate and ball each show listing, reference and difference; each has its convergence.
    assert text.count("<svg ") == 2 + 3
    assert text.count("<img ") == 3 + 3
    assert all(source.startswith(("#", "data:image/webp;base64,")) for source in tags.sources)
    bare = re.sub(r"<script>.*?</script>", "", text, flags=re.DOTALL)
    assert not re.search(r"<script|<link|<iframe|@import|url\((?!#)|http(?!-equiv)", bare)
    for printed in (
        "Figure 4.5 of the report",
        "Figure 4.8 of the report",
        "Figure 4.9 of the report",
        "0.0312",
        "0.375",
    ):
        assert printed in text
    assert "Figure 4.6 of the report" not in text
    assert "distance to &lt;exact&gt;" in text
    assert "<td>0.0156</td><td>2.25</td>" in text
    assert "<td>750 ms</td>" in text
    assert len(text) < 5e6


def test_every_id_on_the_page_is_unique_and_every_reference_meets_one(tmp_path):
    text = field_page.render("Two", (rod(tmp_path / "rod"), rod(tmp_path / "bar")), differences=True)
    ids = re.findall(r'\bid="([^"]*)"', text)
    assert len(ids) == len(set(ids))
    assert set(re.findall(r'(?:href="|url\()#([^")]*)', text)) <= set(ids)


@pytest.mark.parametrize("make", [rod, plate, ball])
def test_a_run_that_is_not_a_number_is_reported_and_not_drawn(tmp_path, make):
    lost = make(tmp_path / "lost", lambda base: base * NAN)
    run = replace(lost.candidates[0], fields=nowhere(lost), outcome=Outcome("diverged", "it blew <up>"))
    text = field_page.render("Lost", (replace(lost, candidates=(run,)),), differences=False)
    read(text)
    assert "it blew &lt;up&gt;" in text
    assert '<span class="bad">not a number</span>' in text
    assert "the listing is not a number, so that they cannot be compared" in text
    assert text.count("nothing to draw") == (0 if make is rod else 2)


def nowhere(example: Comparison):
    return {"psi": example.reference.values * NAN}


def test_nothing_but_a_diverged_reference_has_a_page(tmp_path):
    lost = rod(tmp_path / "rod")
    reference = replace(lost.reference, fields=nowhere(lost), outcome=Outcome("diverged", "no"))
    alone = replace(lost, reference=reference, candidates=(), deviations={}, verdicts=(), ladders=(LADDERS[1],))
    text = field_page.render("Alone", (alone,), differences=False)
    read(text)
    assert "there is a reference alone" in text
    assert "No run has values that are numbers" in text
    assert "What was expected" not in text
    assert "not a number" not in text[text.index("<h3>Runs") : text.index("<h3>Convergence")]
    bad = replace(alone, ladders=(replace(LADDERS[1], errors=(NAN, 0.0, NAN)),))
    assert field_figures.convergence(bad).missing


def test_the_first_sentence_says_how_far_listing_and_equation_part(tmp_path):
    same, other = rod(tmp_path / "rod"), plate(tmp_path / "plate", lambda base: 3 * base)
    assert field_page.apart(same) == "the listing and the equation agree; at the furthest vertex they part by 0."
    # The reference falls to -2 and the listing to 3 times that: they part by 4, twice as far as 2.
    minus = "\N{MINUS SIGN}"
    assert field_page.apart(other) == (
        f"the listing gives {minus}6 to 0, the equation {minus}2 to 0; at the furthest vertex they part by 4, "
        "2 times as far as the equation's solution gets from zero."
    )


def test_the_worst_example_gives_the_word(tmp_path):
    good = rod(tmp_path / "rod")
    other = plate(tmp_path / "plate")
    bad = replace(other, verdicts=(replace(other.verdicts[0], word="fail"),))
    text = field_page.render("Both", (good, bad), differences=False)
    assert '<p class="lead"><span class="badge fail">fail</span> over 2 examples.' in text


@pytest.mark.parametrize(
    ("form", "speed", "printed"),
    [
        ("auto", 100.0, "It is above 1, so that the form is SUPG"),
        ("auto", 1.0, "It is not above 1, so that the form is plain Galerkin"),
        ("supg", 1.0, "The scene asks for SUPG"),
        ("galerkin", 100.0, "The scene asks for plain Galerkin"),
    ],
)
def test_the_form_is_reported_with_its_reason(tmp_path, form, speed, printed):
    # 19 intervals of at most 0.2 with k = 1: the Peclet number v h / 2k of the longest is below 1 at 1 and above it at 100.
    flow = {"name": "advection", "velocity": [speed]}
    made = rod(tmp_path / "rod", effect=[DIFFUSION, flow, SOURCE], element=fields.element(1, form))
    text = field_page.render("Form", (made,), differences=False)
    assert printed in text
    assert ("coth Pe" in text) == ("SUPG" in printed)
    assert ">supg</td>" in text if "SUPG" in printed else ">galerkin</td>" in text
    assert ">as listed</td>" in text


def test_without_an_exact_solution_the_reference_is_the_base(tmp_path):
    made = rod(tmp_path / "rod", lambda base: base + 0.5, exact=None)
    titles = [drawing.title for drawing in field_figures.drawings(made)]
    assert titles == ["Solution at the nodes", "Distance to the reference at the nodes"]
    same = rod(tmp_path / "same", exact=None)
    assert field_figures.drawings(same)[1].missing == "it is zero everywhere, or not a number"


def test_a_flat_surface_in_space_is_drawn(tmp_path):
    # Seen along z it is a line: no window may be without extent, and a field without differences still has a scale.
    def flat(folder):
        points = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1.0]])
        return fields.mesh(folder, points, np.array([[0, 1, 2], [0, 2, 3]]))

    made = example_of(tmp_path / "flat", domain=flat, boundary=[{"on": "rim", "value": "0"}])
    assert all(drawing.markup for drawing in field_figures.drawings(made))


def test_every_row_of_the_differences_is_complete_and_on_the_page():
    rows = field_page.read_differences()
    assert len(rows) == 23
    assert all(getattr(row, key).strip() for row in rows for key in ("section", "text", "listing", "measured"))
    assert len({row.section for row in rows}) == 4
    text = field_page.render("None", (), differences=True)
    read(text)
    assert "<td>23</td>" in text
    assert "27.06" in text
    assert "27.06" not in field_page.render("None", (), differences=False)


def test_a_row_without_a_key_is_named(monkeypatch):
    monkeypatch.setattr(field_page.tomllib, "loads", lambda _: {"difference": [{"section": "one", "text": "two"}]})
    with pytest.raises(InputError, match=r"difference\[0\]\.listing: .*nothing"):
        field_page.read_differences()
