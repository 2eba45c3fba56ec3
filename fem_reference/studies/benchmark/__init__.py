"""Benchmarks: the ``candidates`` of Table 5.1, and the finite element ``reference``, also against an earlier commit."""
