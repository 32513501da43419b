"""Shapes and lines of a mechanism, its icon, and the style of all drawings."""
