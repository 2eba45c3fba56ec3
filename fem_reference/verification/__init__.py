"""The verification catalogue: one file per group of problems whose answers are known, each with its ``ENTRIES``."""
