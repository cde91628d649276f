"""Extrinsics of cameras from simultaneous images of a calibration board: li2020 (1)."""
