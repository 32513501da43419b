"""Error message for a Python package that is not installed."""

EXTRAS = {
    "dask": "sweep",
    "distributed": "sweep",
    "exudyn": "fe",
    "ezdxf": "drawing",
    "fmpy": "fmpy",
    "imageio_ffmpeg": "video",
    "pandas": "sweep",
    "pyarrow": "sweep",
    "rainflow": "fatigue",
    "shapely": "drawing",
    "svgpathtools": "drawing",
    "ziglang": "platforms",
}
"""Extras by the modules of their packages; a module without an extra is required."""


def missing_package(error: ModuleNotFoundError) -> str:
    """Return a sentence with the missing package and the command that installs it.

    Examples
    --------
    >>> print(missing_package(ModuleNotFoundError(name="scipy")))
    the Python package scipy is missing; install it with: python -m pip install "prbm-impact"
    >>> print(missing_package(ModuleNotFoundError(name="fmpy.model_description")))
    the Python package fmpy is missing; install it with: python -m pip install "prbm-impact[fmpy]"
    """
    module = (error.name or str(error)).partition(".")[0]
    extra = f"[{EXTRAS[module]}]" if module in EXTRAS else ""
    return (
        f"the Python package {module} is missing; install it with: "
        f'python -m pip install "prbm-impact{extra}"'
    )
