"""Sections of the page of a comparison: a template for each section, and modules with the facts that some sections need.

Contract (tests/report/test_sections.py): a section is shown only if its numbers exist, and uses no id of another section.
"""
