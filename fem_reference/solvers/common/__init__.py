"""Shared by solvers: what a solver is, the loop over frames, load steps, checks of states."""
