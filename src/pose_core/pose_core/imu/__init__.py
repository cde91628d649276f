"""Body-worn IMUs: readings, alignment with the segments, weighting: zhang2015."""
