"""Equations of motion, constraints, contact laws, statics and modes of an assembled mechanism."""
