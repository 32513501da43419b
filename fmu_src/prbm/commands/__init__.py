"""The command lines ``prbm`` and ``prbm-build-fmu``, one module per command."""
