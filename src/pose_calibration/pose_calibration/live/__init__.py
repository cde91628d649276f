"""Calibration while the sensors run, and its supervision."""
