"""Scenes as arrays and equations for solvers, but independent of any solver: muscles, scalar fields and bodies of any shape."""
