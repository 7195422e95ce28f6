"""Adoption of JSBSim models: their controls, engine and trim are found, and an inner loop is made for them."""
