# SPDX-License-Identifier: Apache-2.0
"""Checks of what YAML files hold: mappings, lists, and where in a file a wrong value stands."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from .errors import InvalidValue, MissingKey, UnknownKey


def located(place: str, make: Callable[..., Any], *args: Any) -> Any:
    """Return make(*args); an error in it that has no file yet is nested under ``place``."""
    try:
        return make(*args)
    except InvalidValue as error:
        raise error if error.source else error.located(place) from None


def sequence(place: str, value: Any) -> list[Any]:
    """Return a value that must be a list, as a list."""
    if not isinstance(value, list | tuple):
        raise InvalidValue(place, value, "a list")
    return list(value)


def mapping(data: Any, needs: set[str], may: set[str] | None) -> dict[str, Any]:
    """Return the keys with a value: all needed and, unless ``may`` is None, no unknown ones."""
    if not isinstance(data, Mapping):
        raise InvalidValue("", data, "a mapping ('key: value')")
    if may is not None:
        valid = sorted(needs | may)
        for key in data:
            if key not in valid:
                raise UnknownKey(_key_text(key), data[key], ", ".join(valid))
    given = {key: value for key, value in data.items() if value is not None}
    for key in sorted(needs):
        if key not in given:
            raise MissingKey(key, None, "given: this key is required")
    return given


def _key_text(key: Any) -> str:
    """Return a key as it may stand in a one-line message."""
    plain = isinstance(key, str) and key.isprintable() and 0 < len(key) <= 60
    return key if plain else repr(key)[:60]
