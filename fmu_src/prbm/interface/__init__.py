"""FMI variables of a mechanism, value references, and the tables of the C kernel."""
