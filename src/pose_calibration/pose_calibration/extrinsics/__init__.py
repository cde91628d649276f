"""Where the sensors stand, from the joints that they see in common."""
