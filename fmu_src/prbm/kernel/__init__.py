"""The C kernel: its sources, its compiler and the constants that it shares with the engine."""
