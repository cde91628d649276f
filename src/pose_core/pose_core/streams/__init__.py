"""Samples of the sensors, and what puts them in order: time alignment, one person."""
