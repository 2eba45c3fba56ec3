"""Code shared by solvers: the solver protocol, the loop over frames, load steps, checks of states."""
