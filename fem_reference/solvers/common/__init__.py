"""Shared by solvers: load steps, checks of states."""
