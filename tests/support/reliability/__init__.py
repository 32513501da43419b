"""The parts of the reliability campaign; ``benchmarks/reliability.py`` runs them."""
