"""Simulations of a mechanism: default experiment, result, impacts, headline."""
