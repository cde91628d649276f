"""What every package of pose fusion shares: names, errors, parameters, counters, node plumbing."""
