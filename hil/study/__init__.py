"""Studies over many runs: experiments, campaigns, tuning."""
