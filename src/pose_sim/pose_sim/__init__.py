"""A synthetic subject: a moving body, virtual Kinects and IMUs, and the ground truth."""
