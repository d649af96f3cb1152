# SPDX-License-Identifier: Apache-2.0
"""All known interfaces: the standard ones, those of rosbags' Jazzy store, and packages read from
folders.
"""

from __future__ import annotations

import threading
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

from . import standard
from .cdr import make_deserializer, make_serializer
from .classes import Message, make_message_class
from .derived import Group, derive_action, derive_service, make_group_class
from .spec import Constant, DefinitionError, Field, FieldType, MessageSpec, parse_message

KINDS = ("msg", "srv", "action")

#: rosidl's stand-in for the members of an empty message
EMPTY_MEMBER = "structure_needs_at_least_one_member"


def package_name(folder: Path) -> str:
    """The name in a folder's package.xml.

    :raises DefinitionError: there is no readable package.xml with a name.
    """
    manifest = folder / "package.xml"
    try:
        name = ElementTree.parse(manifest).getroot().findtext("name", "").strip()
    except (OSError, ElementTree.ParseError) as error:
        raise DefinitionError(f"{manifest}: {error}") from error
    if not name.isidentifier():
        raise DefinitionError(f"{manifest}: the package name {name!r} is no identifier")
    return name


class Registry:
    """Looks up specifications, classes, codecs and type hashes by full interface name.

    Names are ``package/msg/Name``; parts of services and actions are ``package/srv/Name_Request``
    and so on.
    """

    def __init__(self) -> None:
        self._texts: dict[str, tuple[str, str]] = {}
        self._specs: dict[str, MessageSpec] = {}
        self._classes: dict[str, Any] = {}
        self._hashes: dict[str, str] = {}
        self._lock = threading.RLock()
        for name, text in standard.TEXTS.items():
            self._texts[name] = (text, "built in")

    @cached_property
    def _store(self) -> Any:
        return get_typestore(Stores.ROS2_JAZZY)

    @property
    def packages(self) -> frozenset[str]:
        """Names of all packages, known without loading any definition."""
        return standard.PACKAGES | {name.split("/")[0] for name in self._texts}

    def add_package(self, folder: Path) -> str:
        """Add every interface of the package in `folder` and return the package's name."""
        package = package_name(folder)
        with self._lock:
            for kind in KINDS:
                for path in sorted(folder.glob(f"{kind}/*.{kind}")):
                    name = f"{package}/{kind}/{path.stem}"
                    self._texts[name] = (path.read_text(encoding="utf-8"), str(path))
        return package

    def names(self, package: str, kind: str) -> list[str]:
        """Short names of a package's interfaces of one kind (msg, srv or action), sorted."""
        prefix = f"{package}/{kind}/"
        found = {name for name in self._texts if name.startswith(prefix)}
        if package in standard.PACKAGES:
            found |= {name for name in self._store.fielddefs if name.startswith(prefix)}
        return sorted(name[len(prefix) :] for name in found)

    def path(self, name: str) -> Path | None:
        """The file that defines an interface; None for those built in or unknown."""
        source = self._texts.get(name, ("", "built in"))[1]
        return None if source == "built in" else Path(source)

    def folder(self, package: str) -> str:
        """The folder a package was read from; empty for those built in."""
        paths = (self.path(name) for name in self._texts if name.startswith(package + "/"))
        return next((str(path.parents[1]) for path in paths if path), "")

    def spec(self, name: str) -> MessageSpec:
        """The specification of a message, or of a part of a service or action.

        :raises KeyError: nothing of that name is known.
        :raises DefinitionError: its text cannot be read.
        """
        with self._lock:
            if name not in self._specs:
                self._load(name)
            return self._specs[name]

    def _load(self, name: str) -> None:
        package, kind, short = name.split("/")
        if kind == "msg":
            if name in self._texts:
                text, source = self._texts[name]
                try:
                    self._specs[name] = parse_message(text, name)
                except DefinitionError as error:
                    raise DefinitionError(f"{source}: {error}") from error
            elif name in self._store.fielddefs:
                self._specs[name] = self._from_store(name)
        else:
            whole = f"{package}/{kind}/{short.split('_')[0]}"
            if whole in self._texts:
                text, source = self._texts[whole]
                derive = derive_service if kind == "srv" else derive_action
                try:
                    self._specs.update({spec.name: spec for spec in derive(text, whole)})
                except DefinitionError as error:
                    raise DefinitionError(f"{source}: {error}") from error
        if name not in self._specs:
            raise KeyError(f"no interface named {name!r}")

    def _from_store(self, name: str) -> MessageSpec:
        constants, fields = self._store.fielddefs[name]
        defaults = standard.DEFAULTS.get(name, {})
        members = tuple(
            Field(member, _store_type(desc), defaults.get(member))
            for member, desc in fields
            if member != EMPTY_MEMBER
        )
        values = tuple(
            Constant(constant, base, bytes([value]) if base == "byte" else value)
            for constant, base, value in constants
        )
        return MessageSpec(name, members, values)

    def message_class(self, name: str) -> type[Message]:
        """The class of a message, or of a part of a service or action."""
        with self._lock:
            if name not in self._classes:
                self._classes[name] = make_message_class(self.spec(name), self.message_class)
            return self._classes[name]

    def interface_class(self, name: str) -> Any:
        """The class of any interface: a message, a service, an action, or a part of one.

        :raises KeyError: nothing of that name is known.
        """
        package, kind, short = name.split("/")
        whole, _, part = short.partition("_")
        if kind == "msg" or part not in ("", "SendGoal", "GetResult"):
            return self.message_class(name)
        with self._lock:
            if name not in self._classes:
                if f"{package}/{kind}/{whole}" not in self._texts:
                    raise KeyError(f"no interface named {name!r}")
                self._classes[name] = make_group_class(name, self.interface_class)
            return self._classes[name]

    def serializer(self, cls: type[Message]) -> Callable[[Any], bytes]:
        """The function that encodes messages of class `cls`, made on first use."""
        return _codec(cls, "_serialize_", make_serializer, self)

    def deserializer(self, cls: type[Message]) -> Callable[[bytes], Any]:
        """The function that decodes payloads of class `cls`, made on first use."""
        return _codec(cls, "_deserialize_", make_deserializer, self)

    def type_hash(self, name: str) -> str:
        """The RIHS01 hash (REP-2011) of a message, as ``RIHS01_<64 hex digits>``."""
        with self._lock:
            if name not in self._hashes:
                self._register(name)
                self._hashes[name] = self._store.hash_rihs01(name)
            return self._hashes[name]

    def _register(self, name: str) -> None:
        """Give rosbags the definition of `name` and of all it holds, in the form it hashes as
        rosidl does.
        """
        spec = self.spec(name)
        for member in spec.fields:
            if member.type.is_message:
                self._register(member.type.base)
        if name not in self._store.fielddefs:
            members = spec.fields or (Field(EMPTY_MEMBER, FieldType("uint8")),)
            self._store.fielddefs[name] = ([], [(m.name, _to_store(m.type)) for m in members])
        # In .msg files char is an alias of uint8; rosbags hashes it as IDL's char.
        constants, fields = self._store.fielddefs[name]
        self._store.fielddefs[name] = (constants, [(n, _char_to_uint8(desc)) for n, desc in fields])


def _codec(cls: Any, attribute: str, make: Any, registry: Registry) -> Any:
    function = cls.__dict__.get(attribute)
    if function is None:
        function = make(cls._spec_, registry.spec, registry.message_class)
        setattr(cls, attribute, staticmethod(function))
    return getattr(cls, attribute)


def _store_type(desc: Any) -> FieldType:
    """rosbags' description of a member type as ours."""
    kind, value = desc
    if kind == Nodetype.NAME:
        return FieldType(value)
    if kind == Nodetype.BASE:
        return FieldType(value[0], string_bound=value[1])
    inner = _store_type(value[0])
    sort = "array" if kind == Nodetype.ARRAY else "sequence"
    return FieldType(inner.base, sort, value[1], inner.string_bound)


def _to_store(ftype: FieldType) -> Any:
    """The reverse of :func:`_store_type`."""
    desc: Any = (Nodetype.NAME, ftype.base)
    if not ftype.is_message:
        desc = (Nodetype.BASE, (ftype.base, ftype.string_bound))
    if ftype.kind == "scalar":
        return desc
    return (Nodetype.ARRAY if ftype.kind == "array" else Nodetype.SEQUENCE, (desc, ftype.size))


def _char_to_uint8(desc: Any) -> Any:
    kind, value = desc
    if kind == Nodetype.BASE and value[0] == "char":
        return (kind, ("uint8", value[1]))
    if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        return (kind, (_char_to_uint8(value[0]), value[1]))
    return desc


#: the process's interfaces
registry = Registry()

__all__ = ["Group", "Registry", "package_name", "registry"]
