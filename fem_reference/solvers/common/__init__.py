"""Shared by solvers: the loop over frames, load steps, checks of states."""
