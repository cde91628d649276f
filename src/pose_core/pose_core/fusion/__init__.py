"""Pipeline from samples to estimates."""
