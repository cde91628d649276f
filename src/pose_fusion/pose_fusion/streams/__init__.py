"""What sensors say: samples, series of them, their alignment in time, and bags of them."""
