"""Many flights: the matrix that says which, the workers that fly them, the store that keeps them."""
