"""Arithmetic for every frame: plain loops over small arrays, compiled by numba.

The kernels take plain arrays and know neither samples nor parameters.
Conventions: matrices are (rows, columns); a function whose last argument is ``out`` writes its
result there and returns nothing; R[l] is ``R_map_link`` of link l.
"""
