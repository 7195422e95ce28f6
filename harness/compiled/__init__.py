"""Compiled flights: the loop of the closed-form plants, made by Numba from the functions that Python flies."""
