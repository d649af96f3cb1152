# SPDX-License-Identifier: Apache-2.0
"""All known interfaces: those read from folders, the standard ones, those of rosbags' Jazzy
store.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

from . import description, standard
from .cdr import make_deserializer, make_serializer
from .classes import Message, make_message_class
from .derived import derive_action, derive_service, make_group_class
from .packages import KINDS, package_name
from .parser import parse_message, split_sections
from .spec import Constant, DefinitionError, Field, FieldType, MessageSpec

_log = logging.getLogger("embedded_ros")


class Registry:
    """Looks up specifications, classes, codecs and type hashes by full interface name.

    Names are ``package/msg/Name``; parts of services and actions are ``package/srv/Name_Request``
    and so on. A definition from a folder goes before one from a folder added later, and before a
    built-in one; where they differ, a warning says so.
    """

    def __init__(self) -> None:
        self._files: dict[str, list[Path]] = {}
        self._specs: dict[str, MessageSpec] = {}
        self._classes: dict[str, Any] = {}
        self._hashes: dict[str, str] = {}
        self._open: list[str] = []
        self._lock = threading.RLock()

    @cached_property
    def _store(self) -> Any:
        return get_typestore(Stores.ROS2_JAZZY)

    @property
    def packages(self) -> frozenset[str]:
        """Names of all packages, known without loading any definition."""
        return standard.PACKAGES | {name.split("/")[0] for name in self._files}

    def add_package(self, folder: Path) -> str:
        """Add every interface of the package in `folder` and return the package's name.

        :raises DefinitionError: its package.xml cannot be read.
        """
        package = package_name(folder)
        with self._lock:
            for kind in KINDS:
                for path in sorted(folder.glob(f"{kind}/*.{kind}")):
                    files = self._files.setdefault(f"{package}/{kind}/{path.stem}", [])
                    if path not in files:
                        files.append(path)
        return package

    def names(self, package: str, kind: str) -> list[str]:
        """Short names of a package's interfaces of one kind (msg, srv or action), sorted."""
        prefix = f"{package}/{kind}/"
        known = {*self._files, *standard.TEXTS}
        if package in standard.PACKAGES:
            known.update(self._store.fielddefs)
        return sorted(name[len(prefix) :] for name in known if name.startswith(prefix))

    def path(self, name: str) -> Path | None:
        """The file that defines an interface; None for those built in or unknown."""
        return self._files.get(name, [None])[0]

    def folder(self, package: str) -> Path | None:
        """The folder a package was read from; None for those built in."""
        paths = (path for name, (path, *_) in self._files.items() if name.startswith(package + "/"))
        return next((path.parents[1] for path in paths), None)

    def text(self, name: str) -> str:
        """The definition of a message, service or action: its file, comments and all, or one that
        says the same.

        :raises KeyError: nothing of that name is known.
        :raises DefinitionError: the file cannot be read.
        """
        if name in self._files:
            return _read(self._files[name][0])
        if name in standard.TEXTS:
            return standard.TEXTS[name] + "\n"
        return self.spec(name).text()

    def spec(self, name: str) -> MessageSpec:
        """The specification of a message, or of a service, an action or a part of one.

        :raises KeyError: nothing of that name is known.
        :raises DefinitionError: its definition, or that of a type in it, cannot be used.
        """
        with self._lock:
            if name not in self._specs:
                package, kind, short = name.split("/")
                self._load(f"{package}/{kind}/{short.split('_')[0]}")
            if name not in self._specs:
                raise KeyError(f"no interface named {name!r}")
            return self._specs[name]

    def _load(self, name: str) -> None:
        """Read an interface, and before it all that it holds."""
        definitions = self._definitions(name)
        if not definitions:
            return
        source, read = definitions[0]
        specs = read()
        for other, read_other in definitions[1:]:
            if not _same_layout(specs, read_other):
                _log.warning("%s is used for %s; %s differs from it", source, name, other)
        self._open.append(name)
        try:
            for spec in specs:
                for member in spec.fields:
                    if "/msg/" in member.type.base:
                        self._require(member.type.base, f"{source}: member {member.name!r}")
        finally:
            self._open.pop()
        self._specs.update({spec.name: spec for spec in specs})

    def _definitions(self, name: str) -> list[tuple[str, Callable[[], list[MessageSpec]]]]:
        """What defines an interface, the one that counts first: where it is, how to read it."""
        found: list[tuple[str, Callable[[], list[MessageSpec]]]] = [
            (str(path), partial(_parse_file, path, name)) for path in self._files.get(name, ())
        ]
        built_in = f"{name} (built in)"
        if name in standard.TEXTS:
            found.append((built_in, partial(_parse, standard.TEXTS[name], name, built_in)))
        elif name in self._store.fielddefs:
            found.append((built_in, partial(self._from_store, name)))
        return found

    def _require(self, name: str, user: str) -> None:
        if name in self._open:
            raise DefinitionError(f"{user} makes {name} hold itself")
        try:
            self.spec(name)
        except KeyError:
            package = name.split("/")[0]
            lacking = f"no message of that name is in {package}"
            if package not in self.packages:
                lacking = f"the package {package} is on no search path"
            raise DefinitionError(f"{user} is of type {name}, but {lacking}") from None

    def _from_store(self, name: str) -> list[MessageSpec]:
        constants, fields = self._store.fielddefs[name]
        defaults = standard.DEFAULTS.get(name, {})
        members = tuple(
            Field(member, _store_type(desc), defaults.get(member))
            for member, desc in fields
            if member != "structure_needs_at_least_one_member"
        )
        values = tuple(
            Constant(constant, FieldType(base), bytes([value]) if base == "byte" else value)
            for constant, base, value in constants
        )
        return [MessageSpec(name, members, values)]

    def message_class(self, name: str) -> type[Message]:
        """The class of a message, or of a message that is part of a service or action.

        The errors are those of :meth:`spec`.
        """
        with self._lock:
            if name not in self._classes:
                self._classes[name] = make_message_class(self.spec(name), self.message_class)
            return self._classes[name]

    def interface_class(self, name: str) -> Any:
        """The class of any interface: a message, a service, an action, or a part of one.

        The errors are those of :meth:`spec`.
        """
        _, kind, short = name.split("/")
        if kind == "msg" or short.partition("_")[2] not in ("", "SendGoal", "GetResult"):
            return self.message_class(name)
        with self._lock:
            if name not in self._classes:
                self.spec(name)
                self._classes[name] = make_group_class(name, self.interface_class)
            return self._classes[name]

    def serializer(self, cls: type[Message]) -> Callable[[Any], bytes]:
        """The function that encodes messages of class `cls`, made on first use."""
        return _codec(cls, "_serialize_", make_serializer, self)

    def deserializer(self, cls: type[Message]) -> Callable[[bytes], Any]:
        """The function that decodes payloads of class `cls`, made on first use."""
        return _codec(cls, "_deserialize_", make_deserializer, self)

    def type_hash(self, name: str) -> str:
        """The RIHS01 hash (REP-2011) of an interface, as ``RIHS01_<64 hex digits>``.

        The errors are those of :meth:`spec`.
        """
        with self._lock:
            if name not in self._hashes:
                self._hashes[name] = description.type_hash(name, self.spec)
            return self._hashes[name]


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise DefinitionError(f"{path}: {error}") from error


def _parse_file(path: Path, name: str) -> list[MessageSpec]:
    return _parse(_read(path), name, str(path))


def _parse(text: str, name: str, source: str) -> list[MessageSpec]:
    """Every specification that the text of interface `name` makes."""
    kind = name.split("/")[1]
    sections = split_sections(text, 1 + KINDS.index(kind), source)
    if kind == "msg":
        return [parse_message(sections[0], name)]
    return (derive_service if kind == "srv" else derive_action)(sections, name)


def _same_layout(specs: list[MessageSpec], read: Callable[[], list[MessageSpec]]) -> bool:
    """Whether another definition has the same members, and so the same bytes on the wire."""

    def layout(some: list[MessageSpec]) -> Any:
        return [[(member.name, member.type) for member in spec.fields] for spec in some]

    try:
        return layout(read()) == layout(specs)
    except DefinitionError:
        return False


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


#: the process's interfaces
registry = Registry()
