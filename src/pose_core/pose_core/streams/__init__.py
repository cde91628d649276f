"""Samples of the sensors: types, checks of stamps, ordering and time alignment."""
