"""Errors, file writing, texts of units and names: used by every other package."""
