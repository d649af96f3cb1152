# SPDX-License-Identifier: Apache-2.0
"""Makes Python classes from message specifications; they behave as rosidl's classes do."""

from __future__ import annotations

import array
import re
from collections.abc import Callable
from operator import attrgetter
from typing import Any, ClassVar

import numpy as np

from .checks import field_check, numeric_converter
from .spec import CODES, NUMPY_TYPES, Field, FieldType, MessageSpec

_UNSET: Any = object()


def snake_case(name: str) -> str:
    """``MultiArrayLayout`` -> ``multi_array_layout``, as rosidl names its modules."""
    name = re.sub(r"(.)([A-Z][a-z]+)", r"\1_\2", name)
    return re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", name).lower()


class MessageMeta(type):
    """Keeps constants and defaults readable on the class, and read-only."""

    _TYPE_SUPPORT = "embedded_ros"
    _constants_: frozenset[str]

    def __setattr__(cls, name: str, value: Any) -> None:
        if name in cls._constants_:
            raise AttributeError(f"can't set the constant {cls.__name__}.{name}")
        super().__setattr__(name, value)

    def __delattr__(cls, name: str) -> None:
        raise AttributeError(f"can't delete {cls.__name__}.{name}")


class _SlotTypes:
    """Makes ``SLOT_TYPES`` when it is first asked for: tools want it, nodes do not."""

    def __get__(self, instance: Any, cls: Any) -> tuple[Any, ...]:
        types = tuple(_slot_type(member.type) for member in cls._spec_.fields)
        cls.SLOT_TYPES = types
        return types


def _slot_type(ftype: FieldType) -> Any:
    """A member's type as rosidl_parser describes it."""
    from rosidl_parser import definition as parser

    if ftype.kind == "array":
        return parser.Array(_slot_type(ftype.scalar), ftype.size)
    if ftype.kind == "sequence":
        value = _slot_type(ftype.scalar)
        if ftype.size:
            return parser.BoundedSequence(value, ftype.size)
        return parser.UnboundedSequence(value)
    if ftype.is_message:
        *namespaces, name = ftype.base.split("/")
        return parser.NamespacedType(namespaces, name)
    if ftype.base == "string":
        bound = ftype.string_bound
        return parser.BoundedString(bound) if bound else parser.UnboundedString()
    if ftype.base == "wstring":
        bound = ftype.string_bound
        return parser.BoundedWString(bound) if bound else parser.UnboundedWString()
    return parser.BasicType(ftype.idl_name())


class Message(metaclass=MessageMeta):
    """Base of all message classes."""

    __slots__: tuple[str, ...] = ()
    _constants_: ClassVar[frozenset[str]] = frozenset()
    _fields_and_field_types: ClassVar[dict[str, str]] = {}
    _spec_: ClassVar[MessageSpec]
    SLOT_TYPES: ClassVar[Any] = _SlotTypes()

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        """Member names and their IDL type names, in the order of the definition."""
        return dict(cls._fields_and_field_types)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, self.__class__):
            return False
        for slot in self.__slots__:
            mine, theirs = getattr(self, slot), getattr(other, slot)
            if isinstance(mine, np.ndarray) or isinstance(theirs, np.ndarray):
                if not np.array_equal(mine, theirs):
                    return False
            elif mine != theirs:
                return False
        return True

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        parts = []
        for slot in self.__slots__:
            value = getattr(self, slot)
            text = repr(value.tolist()) if isinstance(value, array.array) else repr(value)
            parts.append(f"{slot[1:]}={text}")
        package, kind, _ = type(self)._spec_.name.split("/")
        return f"{package}.{kind}.{type(self).__name__}({', '.join(parts)})"


def _default_factory(member: Field, classes: Callable[[str], type]) -> Callable[[], Any]:
    """A function that makes the initial value of a member."""
    ftype, default = member.type, member.default
    if ftype.is_message:
        cls = classes(ftype.base)
        if ftype.kind == "scalar":
            return cls
        return (lambda: [cls() for _ in range(ftype.size)]) if ftype.kind == "array" else list
    zero: Any = {"bool": False, "byte": b"\0", "string": "", "wstring": ""}.get(ftype.base)
    if zero is None:
        zero = 0.0 if ftype.base.startswith("float") else 0
    if ftype.kind == "scalar":
        value = zero if default is None else type(zero)(default)
        return lambda: value
    values = (
        default if default is not None else [zero] * (ftype.size if ftype.kind == "array" else 0)
    )
    if not ftype.is_numeric:
        return lambda: list(values)
    if ftype.kind == "sequence":
        return lambda: array.array(CODES[ftype.base], values)
    return lambda: np.array(values, dtype=NUMPY_TYPES[ftype.base])


def _refuse(unknown: dict[str, Any]) -> None:
    names = ", ".join(sorted(unknown))
    raise AssertionError(f"Invalid arguments passed to constructor: {names}")


def _make_members(spec: MessageSpec, classes: Callable[[str], type]) -> dict[str, Any]:
    """Write ``__init__`` (keyword arguments only, defaults made only where needed) and the
    properties.
    """
    scope: dict[str, Any] = {"UNSET": _UNSET, "_refuse": _refuse}
    # Members may have any lower-case name: what stands beside them begins with an underscore.
    arguments = "".join(f"{member.name}=UNSET, " for member in spec.fields)
    lines = [f"def __init__(_self, *, {arguments}check_fields=None, **_unknown):"]
    lines.append("    if _unknown: _refuse(_unknown)")
    for member in spec.fields:
        name, ftype = member.name, member.type
        factory = _default_factory(member, classes)
        if ftype.kind == "scalar" and not ftype.is_message:
            scope[f"D_{name}"], default = factory(), f"D_{name}"
        else:
            scope[f"D_{name}"], default = factory, f"D_{name}()"
        given = name
        if ftype.is_numeric and ftype.kind != "scalar" and member.default is None:
            scope[f"N_{name}"] = numeric_converter(ftype)
            given = f"N_{name}({name}, '{name}')"
        lines.append(f"    if {name} is UNSET: _self._{name} = {default}")
        lines.append(f"    else: _self.{name} = {given}")
    for member in spec.fields:
        name, ftype = member.name, member.type
        scope[f"check_{name}"] = field_check(ftype, classes)
        checked = f"check_{name}(value, '{name}')"
        if ftype.kind == "scalar" and ftype.base == "float64":
            # The commonest member by far: spare it the call.
            checked = f"value if type(value) is float else {checked}"
        lines.append(f"def set_{name}(self, value): self._{name} = {checked}")
    exec(compile("\n".join(lines), f"<class {spec.name}>", "exec"), scope)
    members: dict[str, Any] = {"__init__": scope["__init__"]}
    for member in spec.fields:
        members[member.name] = property(
            attrgetter("_" + member.name),
            scope[f"set_{member.name}"],
            doc=f"Message field '{member.name}' ({member.type.idl_name()}).",
        )
    return members


def make_message_class(spec: MessageSpec, classes: Callable[[str], type]) -> type[Message]:
    """Make the class of `spec`; `classes` gives the class of a member's message type."""
    package, kind, name = spec.name.split("/")
    constants = {constant.name: constant.value for constant in spec.constants}
    defaults = {}
    for member in spec.fields:
        if member.default is not None:
            defaults[f"{member.name.upper()}__DEFAULT"] = _default_factory(member, classes)()
    # Messages have no underscores in their names; parts of services and actions do.
    file_stem = name.split("_")[0]
    namespace: dict[str, Any] = {
        "__slots__": tuple("_" + member.name for member in spec.fields),
        "__module__": f"{package}.{kind}._{snake_case(file_stem)}",
        "__doc__": f"Message class '{name}' of {package}.",
        "_spec_": spec,
        "_fields_and_field_types": {m.name: m.type.idl_name() for m in spec.fields},
        "_constants_": frozenset(constants) | frozenset(defaults),
        **constants,
        **defaults,
        **_make_members(spec, classes),
    }
    return MessageMeta(name, (Message,), namespace)  # type: ignore[return-value]
