"""Recordings of skeletons: formats, clocks, joint maps, and a recording as a bag."""
