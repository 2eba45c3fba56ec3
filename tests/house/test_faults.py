"""Planted faults: what is noticed, what is not, tests that fail anyway, and processes that would go on."""

import time
from pathlib import Path

import faults
import pytest
from faults import Fault, failing, plant

from fem_reference.foundations.subprocesses import lives

TESTS = """
import subprocess, sys
import law

def test_sum():
    assert law.total(2, 3) == 5

def test_difference():
    assert law.less(2, 3) == 1

def test_that_leaves_a_process():
    words = [sys.executable, "-c", "import time; time.sleep(600)"]
    open("number", "w").write(str(subprocess.Popen(words).pid))
"""


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project whose difference is wrong, of which pytest knows soon."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "test_law.py").write_text(TESTS)
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers = slow: none is\n")
    text = "def total(a, b):\n    return a + b\n\n\ndef less(a, b):\n    return a - b\n\n\nUNUSED = 7\n"
    (tmp_path / "law.py").write_text(text)
    return tmp_path


def test_a_fault_counts_where_its_test_passes_without_it(project: Path) -> None:
    law = project / "law.py"
    text = law.read_text()
    noticed, unnoticed = (
        Fault("one", "law.py", *change, "test_law") for change in (("a + b", "a - b"), ("= 7", "= 8"))
    )
    assert plant(noticed, project) == ("red", "tests/test_law.py::test_sum")
    assert plant(unnoticed, project) == ("FAILS", "tests/test_law.py::test_difference")
    assert law.read_text() == text
    law.write_text(text.replace("return a - b", "return b - a"))
    assert plant(unnoticed, project)[0] == "GREEN"


def test_a_test_that_fails_anyway_is_found_by_a_name_with_a_blank(project: Path) -> None:
    text = (
        'import pytest\n@pytest.mark.parametrize("name", ["two words"])\ndef test_never(name):\n    assert not name\n'
    )
    (project / "tests" / "test_words.py").write_text(text)
    fault = Fault("none", "law.py", "= 7", "= 8", "test_words")
    assert plant(fault, project) == ("FAILS", "tests/test_words.py::test_never[two words]")


@pytest.mark.parametrize("longest", [60.0, 0.1])
def test_no_process_that_a_test_starts_goes_on(longest: float, project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(faults, "LONGEST", longest)
    failed, said = failing(project, "tests/test_law.py::test_that_leaves_a_process")
    assert failed == ("" if longest > 1 else "no end")  # which is no proof of anything
    assert ("no end" in said) == (longest < 1)
    until = time.monotonic() + 10  # killed, it ends when the system comes to it
    while (number := project / "number").exists() and lives(int(number.read_text())):
        assert time.monotonic() < until


def test_what_would_be_planted_is_named(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """With a record of all but the first, that is the first; none is planted."""
    known = {faults.key(one): {"text": faults.fingerprint(faults.ROOT, one)} for one in faults.FAULTS[1:]}
    monkeypatch.setattr(faults, "recorded", lambda: known)
    monkeypatch.setattr("sys.argv", ["faults.py", "--list", "--stale"])
    assert faults.main() == 0
    assert capsys.readouterr().out == f"{faults.key(faults.FAULTS[0])}: {faults.FAULTS[0].tests}\n"


def test_a_record_stands_while_statements_are_the_same(project: Path) -> None:
    """Words, layout and marks of slow tests may change; a number may not, nor the statements of its tests."""
    fault, law, test = (
        Fault("one", "law.py", "a + b", "a - b", "test_law"),
        project / "law.py",
        project / "tests/test_law.py",
    )
    text, found = law.read_text(), faults.fingerprint(project, fault)
    law.write_text(
        '"""The law."""\n\n' + text.replace(":\n", ':  # words\n    """The law."""\n').replace("b):", "b,\n):")
    )
    assert faults.fingerprint(project, fault) == found
    law.write_text(text.replace("= 7", "= 8"))
    assert faults.fingerprint(project, fault) != found
    law.write_text(text)
    asked = test.read_text()
    test.write_text(asked.replace("def test", "@pytest.mark.slow\ndef test"))
    assert faults.fingerprint(project, fault) == found
    test.write_text(asked.replace("== 5", "== 6"))
    assert faults.fingerprint(project, fault) != found
