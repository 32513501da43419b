"""Simulations of a mechanism: default experiment, result, headline."""
