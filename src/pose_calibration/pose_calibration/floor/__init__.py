"""The floor and the vertical."""
