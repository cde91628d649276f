"""The report's page: its sections and their order."""
