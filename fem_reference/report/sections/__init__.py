"""Sections of the page of a comparison: a template for each, and the facts that some of them need.

Contract (tests/report/test_sections.py): a section is shown where its numbers exist and only there, and repeats no id.
"""
