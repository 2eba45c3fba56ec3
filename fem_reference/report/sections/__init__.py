"""Sections of the page of a comparison: a template each, which that page includes where its numbers exist, and facts of some.

Contract (tests/report/test_sections.py): a section is shown where its numbers exist and only there, and repeats no id.
"""
