"""Recordings of skeletons: formats, clocks, joint maps, and conversion to a bag."""
