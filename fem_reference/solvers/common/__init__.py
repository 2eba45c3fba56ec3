"""Code that several solvers share: the solver protocol, the loop over frames, load steps, and checks of states."""
