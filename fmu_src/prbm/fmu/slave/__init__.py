"""The pythonfmu slave inside every Python FMU: calls of FMI to the engine, without physics.

These modules import the engine by relative names only.  FMUs in one process share ``sys.modules``,
so every FMU contains its own copy of the packages under a unique name.
"""
