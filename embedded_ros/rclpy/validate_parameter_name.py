# SPDX-License-Identifier: Apache-2.0
"""Rules for parameter names."""

from .exceptions import InvalidParameterException


def validate_parameter_name(name: str) -> bool:
    """Return True for a valid parameter name.

    :raises InvalidParameterException: the name is empty.
    """
    if not name:
        raise InvalidParameterException(name)
    return True
