"""Calibration: extrinsics of sensors, their clocks, and sensor-to-segment alignment of IMUs."""
