"""The pythonfmu slave: shipped inside every Python FMU, thin, no physics.

Nothing here imports the engine by its name: two FMUs in one process share ``sys.modules``, so
every FMU carries its own copy under a name of its own and hands it over.
"""
