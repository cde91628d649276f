"""Clock offsets and drifts between sensors, from the motion that all of them see."""
