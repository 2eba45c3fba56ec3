"""What everything stands on: errors, units, records, formulas, meshes as arrays, rigid motions, subprocesses."""
