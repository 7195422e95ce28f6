"""The software on board: guidance laws and estimator in Python, the inner loop as a JSBSim system. No simulator."""
