"""Calibration of body-worn IMUs: sensor-to-segment alignment and plausibility checks."""
