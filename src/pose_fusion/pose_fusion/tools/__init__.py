"""Command-line tools: offline work on bags, and the demo."""
