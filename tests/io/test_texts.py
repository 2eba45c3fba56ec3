"""Texts that anybody may have written: refused where they are too large, too deep or name files elsewhere; and ours come back."""

import tomllib
from pathlib import Path

import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.io import texts
from fem_reference.solvers import recorded


def test_a_text_may_begin_with_the_mark_of_its_order_of_bytes(tmp_path: Path) -> None:
    (tmp_path / "candidate.toml").write_text('name = "mine"', encoding="utf-8-sig")
    assert recorded.about(tmp_path).name == "mine"
    (tmp_path / "a.json").write_text("[1]", encoding="utf-8-sig")
    assert texts.read_json(tmp_path / "a.json", "numbers") == [1]


def test_a_text_that_is_too_large_is_refused_unread(tmp_path: Path) -> None:
    with (tmp_path / "candidate.toml").open("wb") as file:
        file.truncate(2**34)  # of holes
    with pytest.raises(InputError, match=r"candidate\.toml: got a file of 16384 MB, want a TOML file, of at most 2 MB"):
        recorded.about(tmp_path)


@pytest.mark.parametrize("depth", [texts.DEEPEST, texts.DEEPEST + 2])
def test_tables_may_be_as_deep_as_is_said(depth: int, tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text("[" * depth + "]" * depth)
    toml = "a = " + "[" * depth + "]" * depth
    if depth == texts.DEEPEST:
        texts.read_json(tmp_path / "a.json", "lists")
        texts.parse_toml(toml, "a.toml")
        return
    with pytest.raises(InputError, match=r"a\.json: got tables or lists more than 32 deep, want lists"):
        texts.read_json(tmp_path / "a.json", "lists")
    with pytest.raises(InputError, match=r"a\.toml: got tables or lists more than 32 deep"):
        texts.parse_toml(toml, "a.toml")


def test_strings_and_comments_are_no_keys() -> None:
    dotted = ".".join("a" * 40)
    assert texts.parse_toml(f'x = "{dotted} = 1"  # {dotted} = 1', "a.toml") == {"x": f"{dotted} = 1"}


@pytest.mark.parametrize("text", ["plain", 'a "b" \\ c', "line\nline\ttab", "\x7f\x01", "é中\U0001f9b4", ""])
def test_any_text_comes_back_from_toml(text: str) -> None:
    assert tomllib.loads(f"x = {texts.toml_text(text)}") == {"x": text}


def test_xml_with_entities_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.xml").write_text("<a><b/></a>")
    assert [one.tag for one in texts.parsed_xml(tmp_path / "a.xml")] == ["b"]
    (tmp_path / "a.xml").write_text('<!DOCTYPE a [<!ENTITY b "bb">]><a>&b;</a>')
    with pytest.raises(ValueError, match="a document type, which no mesh file needs"):
        texts.parsed_xml(tmp_path / "a.xml")


def test_only_files_of_the_same_folder_are_beside(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "link").symlink_to(tmp_path / "out")
    assert texts.beside(tmp_path / "in" / "a", "below/b") == tmp_path / "in" / "below" / "b"
    for name in ("../out", "link", "/etc/hostname"):
        with pytest.raises(ValueError, match="outside the folder of the file"):
            texts.beside(tmp_path / "in" / "a", name)


def test_a_name_longer_than_names_can_be_is_no_file(tmp_path: Path) -> None:
    assert not texts.is_file(tmp_path / ("a" * 5000))
