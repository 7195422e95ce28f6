"""Searches over settings: each trial is flown over the conditions of a matrix, and its flights are rows of a store."""
