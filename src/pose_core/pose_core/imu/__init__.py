"""Body-worn IMUs: checks of their samples, recent samples, sensor-to-segment alignment."""
