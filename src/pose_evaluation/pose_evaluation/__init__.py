"""Evaluation of results: against a reference, or by internal consistency."""
