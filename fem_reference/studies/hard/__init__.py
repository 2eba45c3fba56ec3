"""Hard cases: which there are, the problems they pose, and every solver on each of them."""
