"""Orientation filters by name."""
