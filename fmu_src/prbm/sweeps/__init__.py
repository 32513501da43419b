"""Studies: simulations of a mechanism or an FMU over rows of parameters."""
