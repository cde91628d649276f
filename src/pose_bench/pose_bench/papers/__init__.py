"""The two papers' experiments, repeated on the synthetic subject, with the printed figures."""
