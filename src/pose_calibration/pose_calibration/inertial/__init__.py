"""Estimation of clock offset and vertical from body-worn IMUs."""
