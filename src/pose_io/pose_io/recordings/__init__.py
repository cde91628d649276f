"""Recordings of skeletons: formats, clocks, joint maps."""
