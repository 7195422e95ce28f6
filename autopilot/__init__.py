"""What flies on board: guidance laws in Python, inner loops as a JSBSim system. Knows no simulator."""
