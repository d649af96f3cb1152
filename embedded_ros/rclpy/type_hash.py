# SPDX-License-Identifier: Apache-2.0
"""Type hashes (REP-2011)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class TypeHash:
    """Version and value (32 bytes) of a type hash; version -1: not known."""

    version: int = -1
    value: bytes = bytes(32)

    def __post_init__(self) -> None:
        if not isinstance(self.version, int) or not isinstance(self.value, bytes):
            raise AssertionError(f"expected int and bytes, got {self.version!r} and {self.value!r}")

    def __str__(self) -> str:
        if self.version <= 0 or len(self.value) != 32:
            return "INVALID"
        return f"RIHS{self.version:02}_{self.value.hex()}"

    @classmethod
    def parse(cls, text: str) -> TypeHash:
        """From ``RIHS01_<hex>``; anything else gives an invalid hash."""
        prefix, _, digits = text.partition("_")
        try:
            return cls(int(prefix.removeprefix("RIHS")), bytes.fromhex(digits))
        except ValueError:
            return cls()
