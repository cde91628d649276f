"""The live viewer in the browser, and the report of a recording."""
