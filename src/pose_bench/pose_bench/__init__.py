"""Benchmarks of the estimators.

``sessions`` simulates the samples that the live bridges would publish of the synthetic subject.
"""
