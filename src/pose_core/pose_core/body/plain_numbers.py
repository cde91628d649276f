"""Numbers in the text files that describe a body."""

from pose_core.arrays import FloatArray


def plain_numbers(values: FloatArray) -> str:
    """Numbers separated by spaces, as in XML and BVH files; never a negative zero."""
    return " ".join(f"{float(value) + 0.0:.5f}" for value in values)
