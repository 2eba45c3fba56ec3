"""Runs, which consist of frames, status, cost and provenance, and the store of runs on disk."""
