"""Samples of the sensors: types, clocks, checks of stamps, ordering and time alignment."""
