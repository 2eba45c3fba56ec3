"""The verification catalogue: one file per family of problems whose answers are known, each with its ``ENTRIES``."""
