"""Motion that is alive: every run beside the truth and simple baselines, with targets."""
