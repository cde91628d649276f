"""Benchmarks of the estimators.

``sessions`` turns the synthetic subject into the very samples that the live bridges would publish.
"""
