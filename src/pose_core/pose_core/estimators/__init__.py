"""The estimators by name; each a file, listed in :mod:`pose_core.estimators.registry`."""
