"""What is made of measures: error bars, comparisons, verdicts, rankings, baselines."""
