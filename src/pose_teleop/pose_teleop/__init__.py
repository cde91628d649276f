"""Tele-operation: a robot follows a person's joint angles and stops at faults."""
