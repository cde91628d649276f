"""What the IMUs tell of clocks and of the vertical."""
