"""What a repository has beside its code: forms, workflows, citation and paper name what there is."""

import re
import shlex
from pathlib import Path

import pytest

import fem_reference as fr
from fem_reference.cli import parser

ROOT = Path(__file__).parents[2]


def text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def test_the_citation_is_of_this_version() -> None:
    assert f"version: {fr.__version__}\n" in text("CITATION.cff")


def test_the_paper_has_its_sections_and_cites_what_there_is() -> None:
    paper = text("paper.md")
    sections = re.findall(r"^# (.+)$", paper, re.MULTILINE)
    assert sections == ["Summary", "Statement of need", "State of the field", "Software design", "References"]
    listed = re.findall(r"^@\w+\{(\w+),", text("paper.bib"), re.MULTILINE)
    assert sorted(set(re.findall(r"@(\w+)", paper.split("---", 2)[2]))) == sorted(listed)


def test_yaml_is_yaml() -> None:
    yaml = pytest.importorskip("yaml")
    files = [*ROOT.glob(".github/**/*.yml"), ROOT / ".pre-commit-config.yaml", ROOT / "CITATION.cff"]
    assert len(files) >= 6
    for path in files:
        assert isinstance(yaml.safe_load(path.read_text(encoding="utf-8")), dict), path
    for path in ROOT.glob(".github/ISSUE_TEMPLATE/[!c]*.yml"):
        form = yaml.safe_load(path.read_text(encoding="utf-8"))
        assert {"name", "description", "body"} <= set(form)
        kinds = {"input", "textarea", "checkboxes", "dropdown", "markdown"}
        assert {entry["type"] for entry in form["body"]} <= kinds
        assert len({entry["id"] for entry in form["body"]}) == len(form["body"])


def test_what_hosted_runs_call_can_be_called() -> None:
    action = text(".github/actions/check/action.yml")
    (call,) = re.findall(r'/fem" (check .*?) \|\|', action.replace("\\\n", ""))
    options = parser().parse_args(shlex.split(call.replace("$BAR", "--error-bar")))
    assert options.error_bar
    script = text("fem")
    for verb in re.findall(r"\./fem (\w+)", text(".github/workflows/test.yml")):
        assert f'[ "${{1-}}" = {verb} ]' in script


def test_commits_are_checked_as_the_tests_check() -> None:
    checked = re.findall(r'^    "\$venv/bin/(.+)"?$', text("fem"), re.MULTILINE)
    wanted = {line.replace('"', "").removesuffix("&").strip() for line in checked}
    entries = set(re.findall(r"entry: \.venv/bin/(.+)", text(".pre-commit-config.yaml")))
    tools = {line for line in wanted if line.startswith(("ruff", "mypy"))}
    assert tools <= entries
    assert len(tools) == 3


def test_no_host_of_a_package_registry_is_named() -> None:
    for path in [
        *ROOT.glob(".github/**/*.yml"),
        ROOT / ".pre-commit-config.yaml",
        ROOT / "pyproject.toml",
        ROOT / "fem",
    ]:
        assert not re.search(r"pypi\.org|pythonhosted|conda\.anaconda", path.read_text(encoding="utf-8")), path
