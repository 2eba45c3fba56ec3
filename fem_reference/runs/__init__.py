"""Runs: frames, status, cost and provenance, and their store on disk."""
