"""Studies of many solutions: error bars, rankings of solvers, and convergence."""
