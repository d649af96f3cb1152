# SPDX-License-Identifier: Apache-2.0
"""Checks of parameters against their declarations."""

from __future__ import annotations

import math
import warnings
from typing import Any

from rcl_interfaces.msg import (
    ParameterDescriptor,
    ParameterType,
    ParameterValue,
    SetParametersResult,
)

from ..parameter import Parameter
from ..validate_parameter_name import validate_parameter_name

PARAM_REL_TOL = 1e-6


def failure(reason: str) -> Any:
    """A result that says why a parameter was not set."""
    return SetParametersResult(successful=False, reason=reason)


def read_declaration(namespace: str, index: int, entry: tuple[Any, ...]) -> tuple[str, Any, Any]:
    """Name, default value and completed descriptor of one declaration."""
    name = entry[0]
    if not isinstance(name, str):
        raise TypeError(f"First element {name} at index {index} in parameters list is not a str.")
    if namespace:
        name = f"{namespace}.{name}"
    validate_parameter_name(name)
    value = entry[1] if len(entry) > 1 else None
    descriptor = entry[2] if len(entry) > 2 else ParameterDescriptor()
    if not isinstance(descriptor, ParameterDescriptor):
        raise TypeError(
            f"Third element {descriptor} at index {index} in parameters list is not a "
            f"ParameterDescriptor."
        )
    if len(entry) == 1:
        warnings.warn(
            f"when declaring parameter named '{name}', declaring a parameter only providing "
            f"its name is "
            "deprecated. Pass a name and a value, a name and a type, or a descriptor with "
            "dynamic_typing=True",
            stacklevel=5,
        )
        descriptor.dynamic_typing = True
    if isinstance(value, Parameter.Type):
        if value == Parameter.Type.NOT_SET:
            raise ValueError(
                f"Cannot declare parameter {{{name}}} as statically typed of type NOT_SET"
            )
        if descriptor.dynamic_typing:
            raise ValueError(
                f"When declaring parameter {{{name}}} passing a descriptor with "
                f"`dynamic_typing=True` "
                "is not allowed when the parameter type is provided"
            )
        descriptor.type = value.value
        return name, None, descriptor
    if not descriptor.dynamic_typing:
        if isinstance(value, ParameterValue):
            descriptor.type = value.type
        else:
            descriptor.type = Parameter.Type.from_parameter_value(value).value
        if descriptor.type == ParameterType.PARAMETER_NOT_SET:
            raise ValueError(
                "Cannot declare a statically typed parameter with default value of type "
                "PARAMETER_NOT_SET"
            )
    return name, value, descriptor


def apply_descriptor(
    parameter: Parameter, descriptor: Any, declared: bool, check_read_only: bool
) -> Any:
    """Check a parameter against its descriptor, and complete the descriptor."""
    name, kind = parameter.name, parameter.type_
    descriptor.name = name
    if check_read_only and descriptor.read_only:
        return failure(f"Trying to set a read-only parameter: {name}.")
    if descriptor.dynamic_typing:
        descriptor.type = kind.value
    elif kind == Parameter.Type.NOT_SET:
        if declared:
            return failure("Static parameter cannot be undeclared")
    elif kind.value != descriptor.type:
        expected = Parameter.Type(descriptor.type)
        return failure(f"Wrong parameter type, expected '{expected}' got '{kind}'")
    if kind == Parameter.Type.INTEGER and descriptor.integer_range:
        return check_range(parameter, descriptor.integer_range[0], False)
    if kind == Parameter.Type.DOUBLE and descriptor.floating_point_range:
        return check_range(parameter, descriptor.floating_point_range[0], True)
    return SetParametersResult(successful=True)


def check_range(parameter: Parameter, limits: Any, floating: bool) -> Any:
    """Check a number against a range; its ends always fit, floating point within rounding."""

    def same(first: float, second: float) -> bool:
        return math.isclose(first, second, rel_tol=PARAM_REL_TOL) if floating else first == second

    value = parameter.value
    low, high = sorted((limits.from_value, limits.to_value))
    if same(value, low) or same(value, high):
        return SetParametersResult(successful=True)
    where = f"Min: {low}, Max: {high}, value: {value}"
    if not low < value < high:
        return failure(f"Parameter {parameter.name} out of range. {where}")
    if limits.step:
        steps = round((value - low) / limits.step)
        if not same(low + steps * limits.step, value):
            return failure(
                f"The parameter value for {parameter.name} is not a valid step. {where}, "
                f"step: {limits.step}"
            )
    return SetParametersResult(successful=True)
