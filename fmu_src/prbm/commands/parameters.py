"""``prbm parameters``: the parameters of a mechanism, and parameter sets for other tools."""

import argparse

from ..base.atomic import check_file, write
from ..files.mechanism_file import load
from ..files.settings import settings, units_of
from ..fmu.parameter_sets import parameter_set, read_parameter_set
from ..fmu.start import interface
from ..mechanism.description import Mechanism


def given_values(mechanism: Mechanism, options: argparse.Namespace) -> dict[str, float]:
    """Return the values of ``--parameters`` and of ``--set``, which has priority."""
    values: dict[str, float] = {}
    if options.parameters is not None:
        values = read_parameter_set(options.parameters, units_of(mechanism))
    return values | settings(mechanism, options.set)


def print_parameters(options: argparse.Namespace) -> None:
    """Print the parameters of a mechanism, and write them as a parameter set."""
    mechanism = load(options.mechanism)
    if options.out is not None:
        check_file(options.out)
    changes = given_values(mechanism, options)
    variables = interface(mechanism, changes)
    shown = [v for v in variables if v.causality == "parameter" or v.name in changes]
    width = max(len(v.name) for v in shown)
    for v in shown:
        value = f"{float(v.start or 0.0):.10g}{'' if v.unit == '1' else f' {v.unit}'}"
        print(f"{v.name:{width}}  {value:18}  {v.description}")
    if options.out is not None:
        write(options.out, parameter_set(mechanism, variables, mechanism.name, changes))
        print(options.out)
