"""The chain from samples to estimates."""
