"""Filters over the kinematic tree: li2020 (3) to (15)."""
