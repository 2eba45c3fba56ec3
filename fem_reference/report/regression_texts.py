"""A regression check as text, JSON, Markdown for a pull request, and JUnit XML for the test page of a pipeline."""

import math
from typing import Any
from xml.etree import ElementTree

from fem_reference.assessment.regression import WORST_FIRST, Check, Judgement, Question
from fem_reference.io.texts import finite

# The maximum number of judgements that a text lists; further judgements are only counted.
MOST_ROWS = 15
_COLUMNS = ("verdict", "question", "statistic", "frame", "was", "now", "allowed", "error bar")


def facts(check: Check) -> dict[str, Any]:
    """The verdict and every judgement as valid JSON; a number that does not exist is None."""
    return {
        "case": check.case,
        "candidate": check.candidate,
        "verdict": check.word,
        "unchanged": check.answer("unchanged"),
        "within": check.answer("within"),
        "notes": list(check.notes),
        "doubts": list(check.doubts),
        "judgements": [
            {
                "verdict": one.word,
                "statistic": one.name,
                **{name: getattr(one, name) for name in ("question", "unit", "frame", "why")},
                **{name: finite(getattr(one, name)) for name in ("was", "current", "allowed")},
                "known_to": finite(one.known),
            }
            for one in check.judgements
        ],
    }


def text(check: Check) -> str:
    """Lines of text with the worst failures, the reasons for inconclusive judgements, and the verdict."""
    lines = _most([f"fail: {_named(one)} at frame {one.frame}: {one.why}" for one in _of(check, "fail")])
    open_: dict[str, list[str]] = {}
    for one in _of(check, "inconclusive"):
        open_.setdefault(one.why, []).append(_named(one))
    lines += _most([f"inconclusive: {why} ({_few(names)})" for why, names in open_.items()])
    lines += _notes(check)
    if _of(check, "fail"):
        lines.append(
            "to see which statistics moved nearer to the reference or further from it, run: "
            f"./fem compare {check.case} --candidate ... --against BASELINE"
        )
    lines += [f"{check.candidate} on {check.case}:", *(f"  {line}" for line in _answers(check))]
    return "\n".join([*lines, f"verdict: {check.word}"])


def markdown(check: Check) -> str:
    """A heading with the verdict, the answers to both questions, notes, and at most ``MOST_ROWS`` judgements, the worst first."""
    shown = check.judgements[:MOST_ROWS]
    lines = [f"### {check.word}: {_escaped(check.candidate)} on {_escaped(check.case)}", ""]
    lines += [f"- {_escaped(line)}" for line in (*_answers(check), *_notes(check))]
    lines += ["", f"| {' | '.join(_COLUMNS)} |", f"|{'---|' * len(_COLUMNS)}"]
    lines += [f"| {' | '.join(map(_escaped, _cells(one)))} |" for one in shown]
    more = len(check.judgements) - len(shown)
    failed = sum(one.word == "fail" for one in check.judgements[MOST_ROWS:])
    rest = f"{failed} of them fail" if failed else "none of them fails"
    return "\n".join([*lines, *(["", f"and {more} more, {rest}."] if more else [])]) + "\n"


def junit(check: Check, seconds: float) -> str:
    """A JUnit suite for the candidate, with a test case for each judgement; inconclusive judgements count as skipped.

    ``seconds``: the duration of the check. The verdict and doubts about the reference are properties of the suite, because a
    doubtful pass is not a failure.
    """
    counts = {"tests": len(check.judgements), "failures": check.count("fail"), "errors": 0}
    counts |= {"skipped": check.count("inconclusive")}
    name = f"{check.case}.{check.candidate}"
    root, suite = _suite(name, {key: str(count) for key, count in counts.items()} | {"time": f"{seconds:.3f}"})
    properties = ElementTree.SubElement(suite, "properties")
    for key, value in (("verdict", check.word), *(("doubt", why) for why in check.doubts)):
        ElementTree.SubElement(properties, "property", {"name": key, "value": value})
    for one in check.judgements:
        element = ElementTree.SubElement(suite, "testcase", {"classname": name, "name": _named(one), "time": "0"})
        if one.word != "pass":
            kind = "failure" if one.word == "fail" else "skipped"
            message = {"message": f"frame {one.frame}: {one.why}"}
            ElementTree.SubElement(element, kind, message).text = "\n".join(
                f"{column}: {cell}" for column, cell in zip(_COLUMNS, _cells(one), strict=True)
            )
    if check.notes:
        ElementTree.SubElement(suite, "system-out").text = "\n".join(check.notes)
    return _xml(root)


def lost(case: str, candidate: str, why: list[str]) -> tuple[str, str]:
    """A JUnit suite with one error, and a Markdown text; both state ``why`` nothing was judged, and replace older files."""
    name, reasons = f"{case}.{candidate}", "\n".join(why)
    root, suite = _suite(name, {"tests": "1", "failures": "0", "errors": "1", "skipped": "0"})
    element = ElementTree.SubElement(suite, "testcase", {"classname": name, "name": "solvers", "time": "0"})
    ElementTree.SubElement(element, "error", {"message": why[0]}).text = reasons
    lines = [f"### failed: {_escaped(candidate)} on {_escaped(case)}", "", *(f"- {reason}" for reason in why)]
    return _xml(root), "\n".join(lines) + "\n"


def _suite(name: str, counts: dict[str, str]) -> tuple[ElementTree.Element, ElementTree.Element]:
    """The root of a JUnit file and its only suite, both with ``counts``."""
    root = ElementTree.Element("testsuites", counts)
    return root, ElementTree.SubElement(root, "testsuite", {"name": name} | counts)


def _xml(root: ElementTree.Element) -> str:
    ElementTree.indent(root, " ")
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _notes(check: Check) -> list[str]:
    return [*(f"note: {note}" for note in check.notes), *(f"reference: doubtful, {why}" for why in check.doubts)]


def _of(check: Check, word: str) -> list[Judgement]:
    return [one for one in check.judgements if one.word == word]


def _named(one: Judgement) -> str:
    return f"{one.name} {one.question}"


def _most(lines: list[str]) -> list[str]:
    """The first ``MOST_ROWS`` of ``lines``, and a line with the number of further lines."""
    more = len(lines) - MOST_ROWS
    return [*lines[:MOST_ROWS], f"and {more} more, listed by --json and --junit"] if more > 0 else lines


def _few(names: list[str]) -> str:
    return f"{', '.join(names[:3])} and {len(names) - 3} more" if len(names) > 4 else ", ".join(names)


def _answers(check: Check) -> list[str]:
    """A line for each question, with its answer and the number of statistics with each verdict."""
    asked: tuple[tuple[Question, str], ...] = (
        ("unchanged", "as it was"),
        ("within", "as near to the reference as allowed"),
    )
    lines = []
    for question, title in asked:
        words = [one.word for one in check.judgements if one.question == question]
        counts = ", ".join(f"{words.count(word)} {word}" for word in WORST_FIRST if word in words)
        lines.append(f"{title} ({question}): {check.answer(question)}" + (f" ({counts})" if counts else ""))
    return lines


def _cells(one: Judgement) -> tuple[str, ...]:
    numbers = (one.was, one.current, one.allowed, one.known)
    texts = (f"{value:.4g} {one.unit}" if math.isfinite(value) else "none" for value in numbers)
    return (one.word, one.question, one.name, str(one.frame), *texts)


def _escaped(cell: str) -> str:
    return cell.replace("|", "\\|")
