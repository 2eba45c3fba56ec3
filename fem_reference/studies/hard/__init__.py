"""Hard cases: their files, their problems, and runs of every solver on each of them."""
