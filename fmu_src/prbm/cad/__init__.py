"""CAD drawings: mechanisms from the outline of a plate, and outlines of mechanisms."""
