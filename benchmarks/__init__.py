"""Speeds as ratios within one run: absolute times are those of a machine and its mood."""
