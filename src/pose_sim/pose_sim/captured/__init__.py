"""Captured motion of real people, measured by simulated sensors.

Figures from it must be labelled: captured motion, simulated sensors.
"""
