"""Foundations of all packages: errors, units, records, formulas, meshes as arrays, rigid motions, subprocesses."""
