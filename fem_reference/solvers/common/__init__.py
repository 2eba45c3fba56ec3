"""What solvers share: load steps, checks of states."""
