"""Calibration of a session: poses of the sensors, their clocks, the person's body measures."""
