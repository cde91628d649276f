"""Bags in and out, without deserialising."""
