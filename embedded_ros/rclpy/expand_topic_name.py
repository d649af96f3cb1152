# SPDX-License-Identifier: Apache-2.0
"""From the names programs use to full names."""

from __future__ import annotations

import re

from .exceptions import NameValidationException
from .validate_namespace import validate_namespace
from .validate_node_name import validate_node_name
from .validate_topic_name import validate_topic_name


def expand_topic_name(topic_name: str, node_name: str, node_namespace: str) -> str:
    """Expand ``~``, substitutions and the namespace.

    :raises ValueError: a name is invalid, or the topic name holds an unknown substitution.
    """
    try:
        validate_topic_name(topic_name)
        validate_node_name(node_name)
        validate_namespace(node_namespace)
    except NameValidationException as error:
        raise ValueError(str(error)) from error
    namespace = node_namespace
    prefix = namespace if namespace.endswith("/") else namespace + "/"

    def substitute(match: re.Match[str]) -> str:
        known = {"node": node_name, "ns": namespace, "namespace": namespace}
        if match[1] not in known:
            raise ValueError(f"unknown substitution '{{{match[1]}}}' in topic name '{topic_name}'")
        return known[match[1]]

    name = topic_name
    if name == "~" or name.startswith("~/"):
        name = prefix + node_name + name[1:]
    name = re.sub(r"\{([^}]*)\}", substitute, name)
    return name if name.startswith("/") else prefix + name
