"""Faults injected into the live graph, and their effect on the joint states.

Captured motion with two simulated cameras and nine IMUs is replayed as messages to a graph of real
processes; the truth is known. A fault is a line in one of the lists of this folder: a name and a
small function that changes the packets in a time window, or signals a process.
"""
