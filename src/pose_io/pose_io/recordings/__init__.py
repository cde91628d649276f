"""Recordings of skeletons in text files: formats, clocks, joint maps."""
