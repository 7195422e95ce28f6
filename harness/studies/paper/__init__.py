"""The paper: its experiments flown anew, its figures, its theory, its claims."""
