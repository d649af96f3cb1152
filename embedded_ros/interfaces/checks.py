# SPDX-License-Identifier: Apache-2.0
"""Type and range checks on assignment to message members.

They raise what the checks of rosidl's generated Python classes raise, AssertionError, so that code
behaves the same here and on ROS 2 with ROS_PYTHON_CHECK_FIELDS=1. Unlike there they are on unless
ROS_PYTHON_CHECK_FIELDS is 0; those of numeric collections, which are converted, always are.
"""

from __future__ import annotations

import array
import math
import os
from collections import UserList, UserString
from collections.abc import Callable, Iterable, Sequence, Set
from typing import Any

import numpy as np

from .spec import CODES, NUMPY_TYPES, STRINGS, FieldType, int_range

FLOAT32_MAX = 3.402823466e38

#: takes (value, member name), returns what is to be stored or raises AssertionError
Check = Callable[[Any, str], Any]
Classes = Callable[[str], type]


def _python_type(base: str, classes: Classes) -> type:
    if "/" in base:
        return classes(base)
    if base in STRINGS:
        return str
    return {"bool": bool, "byte": bytes, "float32": float, "float64": float}.get(base, int)


def _is_float32(value: float) -> bool:
    return not abs(value) > FLOAT32_MAX or math.isinf(value)


def _scalar_check(ftype: FieldType, classes: Classes) -> Check:
    base, bound = ftype.base, ftype.string_bound
    kind: Any = _python_type(base, classes)
    wanted = f"of type '{kind.__name__}'"
    fits: Callable[[Any], bool] | None = None
    unfit = ""
    if ftype.is_message:
        wanted = f"a sub message of type '{kind.__name__}'"
    elif bound:
        kind, wanted = (str, UserString), f"string value not longer than {bound}"
        fits, unfit = lambda value: len(value) <= bound, wanted
    elif base == "byte":
        kind, wanted = (bytes, bytearray), "of type 'bytes' or 'ByteString' with length 1"
        fits, unfit = lambda value: len(value) == 1, wanted
    elif kind is int:
        low, high = int_range(base)
        fits = lambda value: low <= value <= high  # noqa: E731
        unfit = f"{'an unsigned' if low == 0 else 'an'} integer in [{low}, {high}]"
    elif base == "float32":
        fits, unfit = _is_float32, f"a float in [{-FLOAT32_MAX}, {FLOAT32_MAX}]"

    def check(value: Any, name: str) -> Any:
        if not isinstance(value, kind):
            raise AssertionError(f"The '{name}' field must be {wanted}")
        if fits is not None and not fits(value):
            raise AssertionError(f"The '{name}' field must be {unfit}")
        return value

    return check


def _elements_check(ftype: FieldType, classes: Classes) -> tuple[Callable[[Any], bool], str]:
    """Whether all values of a collection are elements of `ftype`, and what they must be."""
    base, bound = ftype.base, ftype.string_bound
    kind = _python_type(base, classes)
    wanted = f"and each value of type '{kind.__name__}'"

    def is_kind(values: Any) -> bool:
        # Nearly always all are of that very type, which is quick to see.
        return set(map(type, values)) <= {kind} or all(isinstance(v, kind) for v in values)

    fits: Callable[[Any], bool] | None = None
    if bound:
        wanted = f"and each string value not longer than {bound} {wanted}"
        fits = lambda values: all(len(v) <= bound for v in values)  # noqa: E731
    elif base == "byte":
        wanted += " with length 1"
        fits = lambda values: all(len(v) == 1 for v in values)  # noqa: E731
    elif kind is int:
        low, high = int_range(base)
        wanted += f" and each {'unsigned ' if low == 0 else ''}integer in [{low}, {high}]"
        fits = lambda values: not values or low <= min(values) <= max(values) <= high  # noqa: E731
    elif base == "float32":
        wanted += f" and each float in [{-FLOAT32_MAX:f}, {FLOAT32_MAX:f}]"
        fits = lambda values: all(map(_is_float32, values))  # noqa: E731
    if fits is None:
        return is_kind, wanted
    return (lambda values: is_kind(values) and fits(values)), wanted


def _collection_check(ftype: FieldType, classes: Classes) -> Check:
    size = ftype.size
    are_elements, wanted = _elements_check(ftype.scalar, classes)
    length = f" with length {'' if ftype.kind == 'array' else '<= '}{size}" if size else ""
    wanted = f"a set or sequence{length} {wanted}"

    def fits(count: int) -> bool:
        return count == size if ftype.kind == "array" else not size or count <= size

    def check(value: Any, name: str) -> Any:
        if (
            not isinstance(value, (Sequence, Set, UserList))
            or isinstance(value, (str, UserString))
            or not fits(len(value))
            or not are_elements(value)
        ):
            raise AssertionError(f"The '{name}' field must be {wanted}")
        return value

    if not ftype.is_numeric:
        return check
    code, kind = CODES[ftype.base], NUMPY_TYPES[ftype.base]

    def check_sequence(value: Any, name: str) -> Any:
        if isinstance(value, array.array):
            if value.typecode != code:
                text = f"array.array() must have the type code of '{code}'"
                raise AssertionError(f"The '{name}' {text}")
        elif isinstance(value, np.ndarray) and value.dtype == kind and value.ndim == 1:
            # Taken by rosidl's classes with their checks off.
            value = array.array(code, value.tobytes())
        elif code == "B" and isinstance(value, (bytes, bytearray)):
            value = array.array(code, value)
        else:
            return array.array(code, check(value, name))
        if not fits(len(value)):
            raise AssertionError(f"The '{name}' array.array() must have a size <= {size}")
        return value

    def check_array(value: Any, name: str) -> Any:
        if isinstance(value, np.ndarray):
            if value.dtype != kind:
                text = f"numpy.ndarray() must have the dtype of 'numpy.{kind.__name__}'"
                raise AssertionError(f"The '{name}' {text}")
            if value.size != size:
                raise AssertionError(f"The '{name}' numpy.ndarray() must have a size of {size}")
            return value
        return np.array(check(value, name), dtype=kind)

    return check_sequence if ftype.kind == "sequence" else check_array


def field_check(ftype: FieldType, classes: Classes) -> Check:
    """The check for assignment to a member of type `ftype`."""
    collection = ftype.kind != "scalar"
    if os.environ.get("ROS_PYTHON_CHECK_FIELDS") == "0" and not (collection and ftype.is_numeric):
        return lambda value, name: value
    return (_collection_check if collection else _scalar_check)(ftype, classes)


def numeric_converter(ftype: FieldType) -> Check:
    """What a constructor does to the value of a numeric collection before it is checked: there
    `[1, 2]` is good for numbers of any type.

    The function raises TypeError, ValueError or OverflowError for what cannot be converted.
    """
    code, size = CODES[ftype.base], ftype.size

    def convert(values: Iterable[Any], name: str) -> Any:
        try:
            if ftype.kind == "sequence":
                return array.array(code, values)
            converted = np.array(values, dtype=NUMPY_TYPES[ftype.base])
        except (TypeError, ValueError, OverflowError) as error:
            raise type(error)(f"The '{name}' field: {error}") from error
        if converted.shape != (size,):
            raise AssertionError(f"The '{name}' numpy.ndarray() must have a size of {size}")
        return converted

    return convert
