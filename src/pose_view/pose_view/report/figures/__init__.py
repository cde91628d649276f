"""The report's figures as SVG, embedded in the page."""
