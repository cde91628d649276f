"""Geometry that all estimates of this package share."""
