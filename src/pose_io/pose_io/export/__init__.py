"""A recorded motion in the formats of other programs: OpenSim, Blender, C3D, CSV, JSON lines."""
