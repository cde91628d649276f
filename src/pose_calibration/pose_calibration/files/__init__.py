"""The file of a session's calibration."""
