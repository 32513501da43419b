"""Numbers derived from models: impact maps, spectra, holding forces, fits, comparisons."""
