"""Runs: frames, status, cost and origin, and their store on disk."""
