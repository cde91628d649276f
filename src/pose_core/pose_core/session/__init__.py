"""What is known of a session: where sensors stand, their clocks, the person's measures."""
