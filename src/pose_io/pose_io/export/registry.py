"""Export formats: one module per format, one line per format here."""

from pose_io.export import bvh, c3d_file, opensim, tables
from pose_io.export.exporter import Exporter

EXPORTERS: dict[str, Exporter] = {
    "trc": opensim.TRC,
    "mot": opensim.MOT,
    "bvh": bvh.BVH,
    "c3d": c3d_file.C3D,
    "csv": tables.CSV,
    "json": tables.JSON_LINES,
}
"""Exporters by the name that ``./pose export --to`` accepts."""
