# SPDX-License-Identifier: Apache-2.0
"""Member types, as ``SLOT_TYPES`` of a message class lists them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


class AbstractType:
    """Any type."""


class AbstractNestableType(AbstractType):
    """A type that arrays and sequences can hold."""


@dataclass
class BasicType(AbstractNestableType):
    """A number, boolean or octet, under its IDL name (``double``, ``boolean``, ``octet``)."""

    typename: str


@dataclass
class NamedType(AbstractNestableType):
    """A type known by name alone."""

    name: str


@dataclass
class NamespacedType(AbstractNestableType):
    """A message: ``NamespacedType(["std_msgs", "msg"], "Header")``."""

    namespaces: Sequence[str]
    name: str

    def namespaced_name(self) -> tuple[str, ...]:
        """``("std_msgs", "msg", "Header")``."""
        return (*self.namespaces, self.name)


class _Bounded:
    def has_maximum_size(self) -> bool:
        return True


class _Unbounded:
    def has_maximum_size(self) -> bool:
        return False


class AbstractGenericString(AbstractNestableType):
    """A string of either width."""


class AbstractString(AbstractGenericString):
    """A string of 8-bit characters."""


class AbstractWString(AbstractGenericString):
    """A string of 16-bit characters."""


@dataclass
class BoundedString(_Bounded, AbstractString):
    """A string of at most so many characters."""

    maximum_size: int


@dataclass
class UnboundedString(_Unbounded, AbstractString):
    """A string of any length."""


@dataclass
class BoundedWString(_Bounded, AbstractWString):
    """A wide string of at most so many characters."""

    maximum_size: int


@dataclass
class UnboundedWString(_Unbounded, AbstractWString):
    """A wide string of any length."""


@dataclass
class AbstractNestedType(AbstractType):
    """A type made of many values of one type."""

    value_type: AbstractNestableType


@dataclass
class Array(_Bounded, AbstractNestedType):
    """Exactly `size` values."""

    size: int


class AbstractSequence(AbstractNestedType):
    """Any number of values."""


@dataclass
class BoundedSequence(_Bounded, AbstractSequence):
    """At most so many values."""

    maximum_size: int


@dataclass
class UnboundedSequence(_Unbounded, AbstractSequence):
    """Any number of values without a bound."""
