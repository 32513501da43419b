"""Mechanism files, units and settings as users write them."""
