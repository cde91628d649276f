"""The report's page: what stands on it, and in which order."""
