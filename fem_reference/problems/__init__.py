"""Scenes as arrays and equations that a solver takes: muscles, scalar fields, bodies of any shape. No solver is known here."""
