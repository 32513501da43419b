"""The command line ``prbm``, one module per command."""
