"""Truths: closed forms, manufactured solutions and published numbers. Imports numpy and scipy only."""
