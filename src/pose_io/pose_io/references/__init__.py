"""Readers of reference measurements: bags, Vicon CSV, C3D, TRC, MOT."""
