"""Errors, file writing, units and names in text, version: used by every other package."""
