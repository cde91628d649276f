"""Readers of what a recording is compared with: bags, Vicon CSV, C3D, TRC, MOT."""
