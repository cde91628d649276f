"""The two papers' experiments, repeated on the synthetic subject, beside the printed figures."""
