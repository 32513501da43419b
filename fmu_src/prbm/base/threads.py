"""The threads of linear algebra."""

THREAD_LIMITS = (
    "MKL_NUM_THREADS",
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
"""Variables of the environment that limit the threads of linear algebra; NumPy reads them when it
is imported.  On matrices of fewer than 300 rows, threads cost more time than they save."""
