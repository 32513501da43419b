"""Shapes and lines of a mechanism, and its icon."""
