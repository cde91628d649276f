"""Command-line tools: a session's files, and the virtual serial devices that replay it."""
