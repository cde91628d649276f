"""What the executables share: how a node or a tool starts, declares, reports and ends."""
