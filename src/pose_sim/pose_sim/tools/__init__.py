"""Command-line tools: a session's files, the virtual serial device, the table of noise."""
