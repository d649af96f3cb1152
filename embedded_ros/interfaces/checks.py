# SPDX-License-Identifier: Apache-2.0
"""Type and range checks on assignment to message members.

They raise what the checks of rosidl's generated Python classes raise, AssertionError, so that code
behaves the same here and on ROS 2 with ROS_PYTHON_CHECK_FIELDS=1. They are always on.
"""

from __future__ import annotations

import array
import math
from collections import UserList, UserString
from collections.abc import Callable, Sequence, Set
from typing import Any

import numpy as np

from .spec import CODES, FieldType, int_range

FLOAT32_MAX = 3.402823466e38

NUMPY_TYPES: dict[str, Any] = {
    "char": np.uint8,
    **{
        f"{sign}int{bits}": getattr(np, f"{sign}int{bits}")
        for sign in ("", "u")
        for bits in (8, 16, 32, 64)
    },
    "float32": np.float32,
    "float64": np.float64,
}

#: takes (value, member name), returns what is to be stored or raises AssertionError
Check = Callable[[Any, str], Any]


def _fail(text: str) -> None:
    raise AssertionError(text)


def _integer(base: str) -> Check:
    low, high = int_range(base)
    kind = "an unsigned integer" if low == 0 else "an integer"

    def check(value: Any, name: str) -> Any:
        if not isinstance(value, int):
            _fail(f"The '{name}' field must be of type 'int'")
        if not low <= value <= high:
            _fail(f"The '{name}' field must be {kind} in [{low}, {high}]")
        return value

    return check


def _float64(value: Any, name: str) -> Any:
    if not isinstance(value, float):
        _fail(f"The '{name}' field must be of type 'float'")
    return value


def _float32(value: Any, name: str) -> Any:
    if not isinstance(value, float):
        _fail(f"The '{name}' field must be of type 'float'")
    if not (-FLOAT32_MAX <= value <= FLOAT32_MAX or math.isinf(value) or math.isnan(value)):
        _fail(f"The '{name}' field must be a float in [-{FLOAT32_MAX}, {FLOAT32_MAX}]")
    return value


def _bool(value: Any, name: str) -> Any:
    if not isinstance(value, bool):
        _fail(f"The '{name}' field must be of type 'bool'")
    return value


def _byte(value: Any, name: str) -> Any:
    if not isinstance(value, (bytes, bytearray)):
        _fail(f"The '{name}' field must be of type 'bytes' or 'ByteString'")
    if len(value) != 1:
        _fail(f"The '{name}' field must be a bytes object of length 1")
    return value


def _string(bound: int) -> Check:
    def check(value: Any, name: str) -> Any:
        if not isinstance(value, str):
            _fail(f"The '{name}' field must be of type 'str'")
        if bound and len(value) > bound:
            _fail(f"The '{name}' field must be string value not longer than {bound}")
        return value

    return check


def _message(cls: type) -> Check:
    def check(value: Any, name: str) -> Any:
        if not isinstance(value, cls):
            _fail(f"The '{name}' field must be a sub message of type '{cls.__name__}'")
        return value

    return check


def scalar_check(ftype: FieldType, classes: Callable[[str], type]) -> Check:
    """The check of one value of `ftype`'s element type."""
    base = ftype.base
    if ftype.is_message:
        return _message(classes(base))
    if base in ("string", "wstring"):
        return _string(ftype.string_bound)
    fixed: dict[str, Check] = {
        "bool": _bool,
        "byte": _byte,
        "float32": _float32,
        "float64": _float64,
    }
    return fixed.get(base) or _integer(base)


def _is_collection(value: Any) -> bool:
    return isinstance(value, (Sequence, Set, UserList)) and not isinstance(value, (str, UserString))


def _collection_check(ftype: FieldType, item: Check) -> Check:
    if ftype.kind == "array":
        wanted = f"a set or sequence with length {ftype.size}"
    elif ftype.size:
        wanted = f"a set or sequence with length <= {ftype.size}"
    else:
        wanted = "a set or sequence"

    def fits(count: int) -> bool:
        if ftype.kind == "array":
            return count == ftype.size
        return not ftype.size or count <= ftype.size

    def check(value: Any, name: str) -> Any:
        if not _is_collection(value) or not fits(len(value)):
            _fail(f"The '{name}' field must be {wanted} of type '{ftype.base}'")
        for element in value:
            item(element, name)
        return value

    if not ftype.is_numeric:
        return check

    code = CODES[ftype.base]
    if ftype.kind == "sequence":

        def check_sequence(value: Any, name: str) -> Any:
            if isinstance(value, array.array):
                if value.typecode != code:
                    _fail(f"The '{name}' array.array() must have the type code of '{code}'")
                if not fits(len(value)):
                    _fail(f"The '{name}' array.array() must have a size <= {ftype.size}")
                return value
            return array.array(code, check(value, name))

        return check_sequence

    kind = NUMPY_TYPES[ftype.base]

    def check_array(value: Any, name: str) -> Any:
        if isinstance(value, np.ndarray):
            if value.dtype != kind:
                _fail(f"The '{name}' numpy.ndarray() must have the dtype of '{kind.__name__}'")
            if value.size != ftype.size:
                _fail(f"The '{name}' numpy.ndarray() must have a size of {ftype.size}")
            return value
        return np.array(list(check(value, name)), dtype=kind)

    return check_array


def field_check(ftype: FieldType, classes: Callable[[str], type]) -> Check:
    """The check for assignment to a member of type `ftype`."""
    item = scalar_check(ftype, classes)
    return item if ftype.kind == "scalar" else _collection_check(ftype, item)
