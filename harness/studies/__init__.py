"""Studies: each a client of the harness, one command and one page."""
