"""Captured people before simulated sensors: motion of real people, seen by virtual trackers.

The motion is captured, the sensors are simulated: figures from it are called that.
"""
