# SPDX-License-Identifier: Apache-2.0
"""The tree of exceptions; every one carries the data that a caller needs to act on it.

CcrError
├── InvalidValue      a value outside its allowed range, and where it stands
│   ├── MissingKey    a required key that is not given
│   └── UnknownKey    a key that is not among the valid ones
├── InvalidFile       a file that cannot be read or parsed at all
├── UnknownName       a name that is not among the valid ones
├── NotConverged      a pose was demanded of a solve that did not converge
└── MissingPackage    an optional dependency is needed and not installed
"""

from __future__ import annotations

import difflib
import reprlib
from collections.abc import Iterable
from typing import Any


class CcrError(Exception):
    """Base of every error this package raises on purpose; its text is one clear line."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by state, so that errors pass from worker processes with their data."""
        return _restored, (type(self), self.args, self.__dict__.copy())


class InvalidValue(CcrError, ValueError):
    """A value is outside its allowed range.

    Attributes:
        place: Where the value stands, e.g. ``cables[0].holes[3]`` or ``pulls.main``.
        value: The offending value.
        allowed: The allowed range, in words.
        source: File the value came from, or ``None``.
    """

    def __init__(self, place: str, value: object, allowed: str, source: str | None = None) -> None:
        self.place = place
        self.value = value
        self.allowed = allowed
        self.source = source
        where = ": ".join(x for x in (source, place) if x)
        super().__init__(f"{where}: {self._complaint()}" if where else self._complaint())

    def _complaint(self) -> str:
        return f"{_short(self.value)} is not allowed; must be {self.allowed}"

    def located(self, prefix: str, source: str | None = None) -> InvalidValue:
        """Return the same error with its place nested under ``prefix`` (and a source file)."""
        place = f"{prefix}.{self.place}" if prefix and self.place else prefix or self.place
        return type(self)(place, self.value, self.allowed, source or self.source)


class MissingKey(InvalidValue):
    """A required key is not given; ``place`` is the key, ``value`` is None."""

    def _complaint(self) -> str:
        return "missing; this key is required"


class UnknownKey(InvalidValue):
    """A key is not among the valid ones; ``place`` is the key, ``allowed`` the valid keys."""

    def _complaint(self) -> str:
        key = self.place.rpartition(".")[2]
        near = difflib.get_close_matches(key, self.allowed.split(", "), n=1)
        hint = f" (did you mean {near[0]!r}?)" if near else ""
        return f"unknown key{hint}; valid keys: {self.allowed}"


class InvalidFile(CcrError):
    """A file cannot be read, or is not the format it should be.

    Attributes:
        path: The file.
        reason: What is wrong with it.
    """

    def __init__(self, path: object, reason: str) -> None:
        self.path = str(path)
        self.reason = reason
        super().__init__(f"{path}: {reason}")


class UnknownName(CcrError, LookupError):
    """A name is not among the valid ones.

    Attributes:
        kind: What is named, e.g. ``cable``.
        name: The unknown name.
        valid: The valid names.
    """

    def __init__(self, kind: str, name: object, valid: Iterable[str]) -> None:
        self.kind = kind
        self.name = name
        self.valid = tuple(valid)
        super().__init__(f"unknown {kind} {_short(name)}; valid: {', '.join(self.valid) or 'none'}")


class NotConverged(CcrError):
    """A converged pose was demanded, and the solve did not converge.

    Attributes:
        finger: Name of the finger; "grasp" for fingers and object together.
        reason: Why, and what to do.
    """

    def __init__(self, finger: str, reason: str) -> None:
        self.finger = finger
        self.reason = reason
        who = finger if finger == "grasp" else f"finger {finger!r}"
        super().__init__(f"{who}: no converged pose: {reason}")


class MissingPackage(CcrError):
    """Something needs an optional dependency that is not installed.

    Attributes:
        package: The package, as pip names it.
        extra: The extra of this package that brings it.
    """

    def __init__(self, what: str, package: str, extra: str) -> None:
        self.package = package
        self.extra = extra
        super().__init__(
            f"{what} needs {package}, which is not installed: install it (pip install {package},"
            f" or this package with its extra {extra!r})"
        )


def _restored(cls: type[CcrError], args: tuple[Any, ...], state: dict[str, Any]) -> CcrError:
    error = cls.__new__(cls, *args)
    error.__dict__.update(state)
    return error


# Bounded in depth and width: a few aliases in a YAML file can stand for a billion values.
_REPR = reprlib.Repr()
_REPR.maxlevel, _REPR.maxlist, _REPR.maxtuple, _REPR.maxdict = 3, 13, 13, 8
_REPR.maxstring, _REPR.maxlong = 80, 40


def _short(value: object) -> str:
    """Return a value as text on one line of at most 80 characters."""
    if hasattr(value, "tolist"):  # a NumPy array or scalar, as the plain values it holds
        value = value.tolist()
    try:
        text = " ".join(_REPR.repr(value).split())
    except ValueError:  # Python refuses to write out an int of thousands of digits
        text = f"<{type(value).__name__}>"
    return text if len(text) <= 80 else text[:77] + "..."
