# SPDX-License-Identifier: Apache-2.0
"""Rules for namespaces."""

from __future__ import annotations

from .exceptions import InvalidNamespaceException
from .impl.names import check_absolute_name


def validate_namespace(namespace: str) -> bool:
    """Return True for a valid absolute namespace.

    :raises InvalidNamespaceException: it is not valid.
    """

    def fail(text: str, index: int) -> None:
        raise InvalidNamespaceException(namespace, text, index)

    if namespace != "/":
        ending = ", unless only a '/'"
        check_absolute_name(namespace, "namespace", fail, ending=ending, limit=245)
    return True
