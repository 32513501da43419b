"""Readers of mechanism files, of units and of the NAME=VALUE settings of a command."""
