"""The plants: models of the aircraft and its inner loop, from the paper's Eq. (1) to six degrees of freedom."""
