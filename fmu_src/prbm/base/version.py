"""The version of the package."""

__version__ = "0.2.0"
GENERATION_TOOL = f"prbm-impact {__version__}"  # Written to FMUs and their documentation.
