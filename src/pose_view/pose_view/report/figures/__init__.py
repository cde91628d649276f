"""The report's figures, as SVG to stand in the page itself: sharp in print, small on a phone."""
