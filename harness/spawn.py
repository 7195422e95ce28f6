"""How a process of the harness begins: spawned, so that it shares nothing with its parent."""

import multiprocessing

SPAWN = multiprocessing.get_context("spawn")
