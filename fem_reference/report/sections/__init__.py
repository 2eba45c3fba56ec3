"""Sections of the page of a comparison: a template for each, and the facts that some of them need.

Contract (tests/report/test_sections.py): a section is shown only if its numbers exist, and repeats no id.
"""
