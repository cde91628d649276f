"""How good a result is: against a reference, or against itself."""
