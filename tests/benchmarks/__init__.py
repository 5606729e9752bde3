"""Speed of the twin against other tools, as ratios within one run."""
