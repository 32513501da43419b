"""Errors, file writing, display units, messages and version, for every other package."""
