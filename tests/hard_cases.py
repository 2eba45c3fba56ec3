"""Every hard case by name, read once in a process of tests."""

from fem_reference.studies.hard import records

CASES = {hard.name: hard for hard in records.read_all()}
