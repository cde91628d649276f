"""Clock offsets and drifts between sensors, from motion that all of them measure."""
