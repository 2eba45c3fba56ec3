"""Scenes as arrays and equations for solvers: muscles, scalar fields, bodies of any shape. Independent of any solver."""
