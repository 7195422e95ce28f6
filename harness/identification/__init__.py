"""Identification of the response to a heading-rate command: flown, fitted, drawn, and stored with the airframe."""
