"""Reference implementations of the filters: the fast ones must give equal results."""
