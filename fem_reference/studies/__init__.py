"""What solves many times: error bars, rankings of solvers, convergence, benchmarks."""
