"""``prbm modelica``: a Modelica package around the FMU of a mechanism."""

import argparse
from pathlib import Path

from ..base.atomic import check_file, write
from ..files.mechanism_file import load
from ..files.settings import UserMistake
from ..fmu.modelica import wrapper
from ..fmu.start import interface
from .parameters import given_values


def write_wrapper(options: argparse.Namespace) -> None:
    """Write the Modelica package of a mechanism."""
    mechanism = load(options.mechanism)
    path = options.out or Path(f"{mechanism.name}Wrapper.mo")
    check_file(path)
    block = options.fmu
    if block is not None and not all(part.isidentifier() for part in block.split(".")):
        raise UserMistake(f"--fmu {block}: write the name of a class of Modelica, PRBDM_fmu")
    variables = interface(mechanism, given_values(mechanism, options))
    text = wrapper(mechanism, variables, options.names, block)
    write(path, text.encode())
    print(path)
