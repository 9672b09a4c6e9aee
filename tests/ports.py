"""Ports of Systems, as they are and as their docstrings say."""

import inspect
import re

from pydrake.systems.framework import System


def ports(system: System) -> tuple[set[str], set[str]]:
    """Names of input and of output ports."""
    inputs = {system.get_input_port(i).get_name() for i in range(system.num_input_ports())}
    return inputs, {system.get_output_port(i).get_name() for i in range(system.num_output_ports())}


def documented_ports(kind: type) -> tuple[set[str], set[str]]:
    """The same from the docstring of a class: lines "name (size), name (size): what" of its two sections."""
    # Python 3.13 strips the indentation of docstrings, earlier ones do not: getdoc does for all.
    before, after = (inspect.getdoc(kind) or "").split("Output ports:")
    return _names(before.partition("Input ports")[2].partition(":")[2]), _names(after.partition("\nAttributes:")[0])


def _names(section: str) -> set[str]:
    lines = [line.strip() for line in section.splitlines() if re.match(r" {4}\S", line)]
    heads = [line.split(":")[0] for line in lines if ":" in line]
    return {name for head in heads for name in re.sub(r" \([^)]*\)", "", head).split(", ")}
