"""Live calibration and its monitoring."""
