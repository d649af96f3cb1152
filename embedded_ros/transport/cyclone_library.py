# SPDX-License-Identifier: Apache-2.0
"""Functions of the Cyclone DDS library that are called past its Python binding.

By ctypes, which lets other threads of Python run meanwhile; the binding's write does not.
"""

from __future__ import annotations

import ctypes
from typing import Any

from cyclonedds.internal import DDS


class Payload(ctypes.Structure):
    """What the binding's data types take as a sample: an encoded message."""

    _fields_ = (("data", ctypes.c_char_p), ("size", ctypes.c_size_t))


def _function(name: str, *arguments: Any) -> Any:
    # Indexing gives a function of our own, not that on which the binding set other types.
    function = DDS._dll_handle[name]
    function.argtypes = arguments
    return function


_entity = ctypes.c_int32
_type_pointer = ctypes.POINTER(ctypes.c_void_p)
dds_create_topic_sertype = _function(
    "dds_create_topic_sertype", _entity, ctypes.c_char_p, _type_pointer, *[ctypes.c_void_p] * 3
)
dds_get_entity_sertype = _function("dds_get_entity_sertype", _entity, _type_pointer)
ddsi_sertype_ref = _function("ddsi_sertype_ref", ctypes.c_void_p)
dds_write = _function("dds_write", _entity, ctypes.POINTER(Payload))
dds_wait_for_acks = _function("dds_wait_for_acks", _entity, ctypes.c_int64)
dds_assert_liveliness = _function("dds_assert_liveliness", _entity)
dds_waitset_attach = _function("dds_waitset_attach", _entity, _entity, ctypes.c_ssize_t)
dds_waitset_detach = _function("dds_waitset_detach", _entity, _entity)
dds_waitset_wait = _function(
    "dds_waitset_wait", _entity, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int64
)
