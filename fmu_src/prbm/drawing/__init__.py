"""Shapes and outlines of a mechanism, its icon, and the style of all drawings."""
