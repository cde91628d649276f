"""Runs ROS 2 YAML launch files, the same ones that ``ros2 launch`` takes.

``document`` reads a file, ``substitutions`` resolves ``$(…)``, ``evaluation`` turns the actions
into processes (``processes``), ``supervising`` runs them, ``up`` is the command.
"""
