"""Links from messages: each leads to a page and a heading that are there, and the messages that they are for have them."""

import re

import pages
import pytest

from fem_reference.cli import BAD_INPUT, main
from fem_reference.cli._explained import PAGES, page_of


@pytest.mark.parametrize("name", sorted({name for _, name in PAGES}))
def test_the_page_and_its_heading_are_there(name: str) -> None:
    file, _, anchor = name.partition("#")
    headings = re.findall(r"^#+ (.*)$", pages.page(f"docs/{file}"), re.MULTILINE)
    assert not anchor or anchor in [heading.lower().replace(" ", "-") for heading in headings]


def test_a_key_that_is_wrong_leads_to_the_page_of_keys(tmp_path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "case.toml").write_text('titel = "My muscle"\n', encoding="utf-8")
    assert main(["show", str(tmp_path)]) == BAD_INPUT
    assert capsys.readouterr().err.splitlines()[-1] == "see docs/scene_keys.md"


def test_a_verdict_that_puzzles_leads_to_its_page_and_a_plain_one_to_none() -> None:
    assert page_of("verdict: doubtful pass") == "docs/measures.md#verdicts"
    assert page_of("verdict: inconclusive") == "docs/error_bars.md"
    assert page_of("verdict: not judged") == "docs/measures.md#verdicts"
    assert page_of("verdict: pass") == page_of("verdict: fail") == ""


def test_the_effects_and_regions_of_one_of_several_muscles_have_the_same_pages() -> None:
    assert page_of('a/case.toml: muscle[1].effect[0].mu: got "1 mm", want a pressure') == "docs/effects.md"
    assert page_of("a/case.toml: muscle[1].region[0].width: got 0") == "docs/effects.md#regions"
    assert page_of("meshes/a/card.toml: licence: got nothing") == ""
