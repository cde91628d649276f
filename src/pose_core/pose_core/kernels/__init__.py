"""The arithmetic of every frame, compiled: plain loops over small arrays, which numba makes fast.

Nothing here knows of samples, streams or parameters' names; the classes that own the numbers hand
them over as arrays. Conventions: matrices are (rows, columns); a function whose last argument is
``out`` writes there and returns nothing; R[l] is ``R_map_link`` of link l.
"""
