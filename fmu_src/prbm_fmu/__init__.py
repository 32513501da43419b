"""The exporter: mechanisms become Functional Mock-up Units."""

__version__ = "0.1.0"
