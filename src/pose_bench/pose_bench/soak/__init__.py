"""Live operation for a day, driven by a virtual clock in one process."""
