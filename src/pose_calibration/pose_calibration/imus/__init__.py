"""Calibration of body-worn IMUs: how each sits, and whether it sits on the right segment."""
