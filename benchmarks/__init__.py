"""Speeds as ratios within one run: absolute times are those of a machine and its mood."""

from harness.threads import use_one_thread

use_one_thread()  # as every command does
