"""What the airframes do with a heading-rate command: flown, fitted, drawn, and kept beside them."""
