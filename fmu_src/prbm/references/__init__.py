"""Independent routes to the same results: finite elements, beam theory, fixed-step integration."""
