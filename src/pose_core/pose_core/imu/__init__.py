"""Body-worn IMUs: samples, sensor-to-segment alignment, weighting of zhang2015."""
