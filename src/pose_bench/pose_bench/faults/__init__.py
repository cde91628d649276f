"""Faults injected into the live graph, and what the joint states say meanwhile.

A captured person before two simulated cameras, with nine IMUs on, is replayed on the wire to a
graph of real processes; the truth is known. A fault is a line in one of the lists of this folder: a
name and a small function that changes the packets of its window, or signals a process.
"""
