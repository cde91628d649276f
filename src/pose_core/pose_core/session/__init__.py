"""Results of calibrating a session: poses of the sensors, floor, the person's body measures."""
