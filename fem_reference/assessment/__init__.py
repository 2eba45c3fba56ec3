"""Assessment of measures: error bars, comparisons, verdicts, rankings, baselines."""
