"""Hard cases: their files, the problems that they pose, and every solver on each of them."""
