"""Studies of many solutions: error bars, rankings of solvers, convergence."""
