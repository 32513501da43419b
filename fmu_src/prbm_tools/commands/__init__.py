"""The commands of ``prbm``, one module a family; :mod:`prbm_tools.cli` has their arguments."""
