"""Finds where sensors stand, how their clocks run and how IMUs are mounted."""
