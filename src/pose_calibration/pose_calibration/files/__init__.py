"""Reading and writing the file of a session's calibration."""
