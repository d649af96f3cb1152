# SPDX-License-Identifier: Apache-2.0
"""The import hook: serves rclpy, its companions and the interface packages under their own names,
unless they are installed.
"""

from __future__ import annotations

import importlib.util
import logging
import sys
from collections.abc import Iterable, Mapping, Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

from . import installed
from .interfaces.classes import snake_case
from .interfaces.packages import KINDS, folders_of_environment, interface_folders
from .interfaces.registry import Registry
from .interfaces.spec import DefinitionError

#: packages of this folder that are served under their top-level name
FACADES = ("rclpy", "rosidl_parser", "rosidl_runtime_py", "tf2_ros")


class _InterfaceLoader(Loader):
    """Fills the modules ``package``, ``package.kind`` and ``package.kind._name``."""

    def __init__(self, registry: Registry) -> None:
        self.registry = registry

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        return None

    def exec_module(self, module: ModuleType) -> None:
        parts = module.__name__.split(".")
        if len(parts) == 2:
            self._serve_classes(module, *parts)
        elif len(parts) == 3:
            package, kind, stem = parts
            for short in self.registry.names(package, kind):
                if "_" + snake_case(short) == stem:
                    setattr(module, short, getattr(sys.modules[f"{package}.{kind}"], short))
                    self._serve_parts(module, package, kind, short)

    def _serve_classes(self, module: ModuleType, package: str, kind: str) -> None:
        """Make classes when they are first asked for: a package has up to forty, a program uses
        few.
        """
        registry = self.registry

        def get(name: str) -> Any:
            if name == "__all__":
                return registry.names(package, kind)
            if not name.startswith("_"):
                try:
                    value = registry.interface_class(f"{package}/{kind}/{name}")
                except KeyError:
                    pass
                else:
                    setattr(module, name, value)
                    return value
            raise AttributeError(f"module '{module.__name__}' has no attribute '{name}'")

        module.__getattr__ = get  # type: ignore[method-assign]
        module.__dir__ = lambda: registry.names(package, kind)  # type: ignore[method-assign]

    def _serve_parts(self, module: ModuleType, package: str, kind: str, short: str) -> None:
        registry = self.registry

        def get(name: str) -> Any:
            if name.startswith(short + "_"):
                try:
                    return registry.interface_class(f"{package}/{kind}/{name}")
                except KeyError:
                    pass
            raise AttributeError(f"module '{module.__name__}' has no attribute '{name}'")

        module.__getattr__ = get  # type: ignore[method-assign]


class InterfaceFinder(MetaPathFinder):
    """Finds a fixed set of top-level names and what is inside them."""

    def __init__(self, registry: Registry) -> None:
        self.registry = registry
        self.loader = _InterfaceLoader(registry)
        self.packages = registry.packages

    def add_paths(self, paths: Iterable[Path | str]) -> None:
        """Serve the interface packages at or below these folders as well.

        :raises FileNotFoundError: there is no such folder.
        :raises DefinitionError: a package.xml there cannot be read.
        """
        for folder in [folder for path in paths for folder in interface_folders(path)]:
            self.registry.add_package(folder)
        self.packages = self.registry.packages

    def add_environment(self, environ: Mapping[str, str]) -> None:
        """Serve the interface packages that environment variables lead to as well."""
        for folder in folders_of_environment(environ):
            try:
                self.registry.add_package(folder)
            except DefinitionError as error:
                logging.getLogger("embedded_ros").warning("%s: package left out", error)
        self.packages = self.registry.packages

    def find_spec(
        self,
        fullname: str,
        path: Sequence[str] | None = None,
        target: ModuleType | None = None,
    ) -> ModuleSpec | None:
        parts = fullname.split(".")
        if parts[0] not in FACADES and (parts[0] not in self.packages or len(parts) > 3):
            return None
        if installed(fullname) if len(parts) == 1 else self._foreign(parts[0]):
            return None
        if parts[0] in FACADES:
            # Submodules are found by the ordinary path finder through the package's __path__.
            return self._facade(fullname) if len(parts) == 1 else None
        package = parts[0]
        if len(parts) > 1 and (parts[1] not in KINDS or not self.registry.names(package, parts[1])):
            return None
        if len(parts) == 3 and parts[2] not in {
            "_" + snake_case(name) for name in self.registry.names(package, parts[1])
        }:
            return None
        spec = ModuleSpec(fullname, self.loader, is_package=len(parts) < 3)
        if len(parts) == 1 and (folder := self.registry.folder(package)) is not None:
            # Some carry Python modules too, which rosidl installs beside the generated ones.
            spec.submodule_search_locations = [str(folder / package), str(folder / "src" / package)]
        return spec

    def _foreign(self, package: str) -> bool:
        spec = sys.modules[package].__spec__
        return package not in FACADES and (spec is None or spec.loader is not self.loader)

    @staticmethod
    def _facade(name: str) -> ModuleSpec | None:
        folder = Path(__file__).parent / name
        return importlib.util.spec_from_file_location(
            name, folder / "__init__.py", submodule_search_locations=[str(folder)]
        )
