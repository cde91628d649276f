"""A running graph, as people and scripts see it: rates, latencies, tracking, what is wrong."""
