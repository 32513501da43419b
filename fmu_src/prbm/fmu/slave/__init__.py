"""The pythonfmu slave: shipped inside every Python FMU, thin, no physics.

Nothing here imports the engine by an absolute name: two FMUs in one process share ``sys.modules``,
so every FMU carries its own copy of these packages under a name of its own.
"""
