"""The report's tables, as values that the page and the tests read alike."""
