"""Tables in HTML: all content is plain text."""

import xml.etree.ElementTree as ET

from fem_reference.foundations.markup import fact_table, table

HOSTILE = "<script>&"


def test_cells_are_text_whatever_they_hold() -> None:
    root = ET.fromstring(f"<div>{table(HOSTILE, ['a', HOSTILE], [[1, HOSTILE], [2.5, None]])}</div>")
    assert [cell.text for cell in root.iter("td")] == ["1", HOSTILE, "2.5", "None"]
    assert [cell.text for cell in root.iter("th")] == ["a", HOSTILE]
    assert [title.text for title in root.iter("b")] == [HOSTILE]


def test_facts_are_rows_of_name_and_value() -> None:
    root = ET.fromstring(f"<div>{fact_table('run', {'status': HOSTILE, 'frames': 3})}</div>")
    assert [(row[0].text, row[1].text) for row in root.iter("tr")] == [("status", HOSTILE), ("frames", "3")]
