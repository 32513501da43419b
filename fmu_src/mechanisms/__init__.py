"""Shipped mechanisms, one TOML file each: data, no code."""
