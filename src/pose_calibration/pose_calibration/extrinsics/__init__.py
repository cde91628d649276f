"""Extrinsics from joints that several sensors measure."""
