"""Compiled arithmetic of every frame: plain loops over small arrays, compiled by numba.

Nothing here knows of samples, streams or parameters' names; the callers pass plain arrays.
Conventions: matrices are (rows, columns); a function whose last argument is ``out`` writes there
and returns nothing; R[l] is ``R_map_link`` of link l.
"""
