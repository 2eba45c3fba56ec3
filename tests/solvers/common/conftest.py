"""Fixtures that these tests share with those of exports."""

from exporting import built, exported, scene  # noqa: F401 - fixtures
