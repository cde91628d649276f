"""Serialised messages (CDR), read and written many at a time."""
