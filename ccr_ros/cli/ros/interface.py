# SPDX-License-Identifier: Apache-2.0
"""Look at message, service and action types, as `ros2 interface` does.

  ccr interface list -m
  ccr interface show geometry_msgs/msg/Pose

`ccr interface VERB --help` tells more.
"""

from __future__ import annotations

import argparse
import contextlib
import re
import sys
from collections.abc import Iterable
from pathlib import Path

from ccr_ros.cli.ros.graph import unknown
from ccr_ros.cli.ros.types import interface_type
from ccr_ros.cli.ros.verbs import Verbs
from ccr_ros.cli.ros.verbs import run_verb as run
from ccr_ros.model.errors import CcrError, InvalidValue
from ccr_ros.runtime import real_ros

__all__ = ["add_arguments", "run"]

_KINDS = {
    "msgs": ("Messages", "message"),
    "srvs": ("Services", "service"),
    "actions": ("Actions", "action"),
}
_PRIMITIVE = re.compile(r"bool|byte|char|u?int(8|16|32|64)|float(32|64)|w?string")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verbs and their arguments."""
    verbs = Verbs(parser)
    one = verbs.add("list", run_list, "list all types", graph=False)
    _add_kinds(one)

    one = verbs.add("show", run_show, "print the definition of a type", graph=False)
    one.add_argument("type", help="the type, as geometry_msgs/msg/Pose; - reads standard input")
    comments = one.add_mutually_exclusive_group()
    comments.add_argument(
        "--all-comments", action="store_true", help="with the comments of the nested types too"
    )
    comments.add_argument("--no-comments", action="store_true", help="without comments")

    one = verbs.add("package", run_package, "list the types of one package", graph=False)
    one.add_argument("package_name", help="name of the package, as std_msgs")
    _add_kinds(one)

    one = verbs.add("packages", run_packages, "list the packages that have types", graph=False)
    _add_kinds(one)

    one = verbs.add("proto", run_proto, "print an empty message of a type as YAML", graph=False)
    one.add_argument("type", help="the type; of a service the request, of an action the goal")
    one.add_argument("--no-quotes", action="store_true", help="without quotes around it")


def _add_kinds(parser: argparse.ArgumentParser) -> None:
    for kind, (title, _) in _KINDS.items():
        parser.add_argument(
            f"-{kind[0]}", f"--only-{kind}", action="store_true", help=f"only {title.lower()}"
        )


def _chosen(args: argparse.Namespace) -> list[str]:
    return [kind for kind in _KINDS if getattr(args, f"only_{kind}")] or list(_KINDS)


def _names(kind: str, packages: Iterable[str] = ()) -> dict[str, list[str]]:
    import rosidl_runtime_py

    get = getattr(rosidl_runtime_py, f"get_{_KINDS[kind][1]}_interfaces")
    return {package: sorted(names) for package, names in sorted(get(list(packages)).items())}


def run_list(args: argparse.Namespace) -> None:
    """Print all types."""
    for kind in _chosen(args):
        print(f"{_KINDS[kind][0]}:")
        for package, names in _names(kind).items():
            for name in names:
                print(f"    {package}/{name}")


def run_package(args: argparse.Namespace) -> None:
    """Print the types of a package."""
    for kind in _chosen(args):
        try:
            names = _names(kind, [args.package_name])
        except LookupError:
            import rosidl_runtime_py

            packages = rosidl_runtime_py.get_interface_packages()
            raise unknown("package", args.package_name, packages) from None
        for name in names.get(args.package_name, ()):
            print(f"{args.package_name}/{name}")


def run_packages(args: argparse.Namespace) -> None:
    """Print the packages that have types of the kinds asked for."""
    for package in sorted({package for kind in _chosen(args) for package in _names(kind)}):
        print(package)


def run_proto(args: argparse.Namespace) -> None:
    """Print a message with default values as YAML."""
    from rosidl_runtime_py import message_to_yaml

    kind = interface_type(args.type)
    part = getattr(kind, "Goal", None) or getattr(kind, "Request", None) or kind
    text = message_to_yaml(part())
    print(text if args.no_quotes else f'"{text}"')


def run_show(args: argparse.Namespace) -> None:
    """Print the definition of a type, and below each field that of its own type."""
    name = sys.stdin.readline().strip() if args.type == "-" else args.type
    if len([part for part in name.split("/") if part]) != 3:
        raise InvalidValue("type", name, "written as package/msg/Name (or srv, action)")
    _show(name, comments=not args.no_comments, nested_comments=args.all_comments)


def _show(name: str, comments: bool, nested_comments: bool, indent: str = "") -> None:
    for line in _definition(name):
        code = line.partition("#")[0].rstrip()
        if comments:
            print(indent + line if line else "")
        elif code:
            print(indent + code)
        found = re.match(r"\s*([A-Za-z]\w*(?:/\w+)?)", code)
        if found and not _PRIMITIVE.fullmatch(found[1]):
            package, _, short = found[1].rpartition("/")
            nested = f"{package or name.split('/')[0]}/msg/{short}"
            _show(nested, nested_comments, nested_comments, indent + "\t")


def _definition(name: str) -> list[str]:
    from rosidl_runtime_py import get_interface_path

    try:
        text = Path(get_interface_path(name)).read_text(encoding="utf-8")
    except (LookupError, ValueError):
        text = _built_in(name)
    return [line.rstrip() for line in text.splitlines()]


def _built_in(name: str) -> str:
    """Return the text of a type that has no file: the embedded runtime has such."""
    if not real_ros():
        from embedded_ros.interfaces.registry import registry

        with contextlib.suppress(KeyError):
            return registry.text(name)
    interface_type(name)  # raises the error that tells what there is
    raise CcrError(f"{name!r} has no definition that can be read")
