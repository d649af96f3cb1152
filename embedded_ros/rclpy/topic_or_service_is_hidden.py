# SPDX-License-Identifier: Apache-2.0
"""Hidden names."""

HIDDEN_TOPIC_PREFIX = "_"
TOPIC_SEPERATOR_STRING = "/"


def topic_or_service_is_hidden(name: str) -> bool:
    """Whether any part of a topic or service name starts with an underscore."""
    return any(part.startswith(HIDDEN_TOPIC_PREFIX) for part in name.split(TOPIC_SEPERATOR_STRING))
