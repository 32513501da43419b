"""Parameter sweeps over FMUs."""
