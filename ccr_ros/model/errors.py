# SPDX-License-Identifier: Apache-2.0
"""The tree of exceptions; every one carries the data that a caller needs to act on it.

    CcrError
    ├── InvalidValue      a value outside its allowed range, and where it stands
    ├── InvalidFile       a file that cannot be read or parsed at all
    ├── UnknownName       a name that is not among the valid ones
    └── NotConverged      a pose was demanded of a solve that did not converge
"""

from __future__ import annotations

from collections.abc import Iterable


class CcrError(Exception):
    """Base of every error this package raises on purpose; its text is one clear line."""


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
        where = f"{source}: {place}" if source else place
        super().__init__(f"{where}: {_short(value)} is not allowed; must be {allowed}")

    def located(self, prefix: str, source: str | None = None) -> InvalidValue:
        """Return the same error with its place nested under ``prefix`` (and a source file)."""
        place = f"{prefix}.{self.place}" if prefix and self.place else prefix or self.place
        return InvalidValue(place, self.value, self.allowed, source or self.source)


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
        finger: Name of the finger.
        reason: Why, and what to do.
    """

    def __init__(self, finger: str, reason: str) -> None:
        self.finger = finger
        self.reason = reason
        super().__init__(f"finger {finger!r}: no converged pose: {reason}")


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."
