"""Systems of FMUs: co-simulation master, SSP packages, containers, model exchange."""
