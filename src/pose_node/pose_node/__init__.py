"""Code shared by the executables: start, parameters, diagnostics and end of nodes and tools."""
