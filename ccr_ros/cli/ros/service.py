# SPDX-License-Identifier: Apache-2.0
"""Look at services, and call them, as `ros2 service` does.

  ccr service list -t
  ccr service call /add_two_ints example_interfaces/srv/AddTwoInts '{a: 1, b: 2}'

`ccr service VERB --help` tells more.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

from ccr_ros.cli.ros.graph import (
    full_name,
    graph_node,
    spin_until,
    types_of,
    visible,
    wait_for_type,
)
from ccr_ros.cli.ros.types import fill, full_type_name, read_values, service_type
from ccr_ros.cli.ros.verbs import Verbs, positive_float
from ccr_ros.cli.ros.verbs import run_verb as run
from ccr_ros.model.errors import CcrError

__all__ = ["add_arguments", "run"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verbs and their arguments."""
    verbs = Verbs(parser)
    one = verbs.add("list", run_list, "list the services")
    one.add_argument("-t", "--show-types", action="store_true", help="with their types")
    one.add_argument("-c", "--count-services", action="store_true", help="only how many")
    one.add_argument("--include-hidden-services", action="store_true", help="hidden ones as well")

    one = verbs.add("call", run_call, "call a service and print the response")
    one.add_argument("service_name", help="name of the service, as /add_two_ints")
    one.add_argument("service_type", help="its type, as std_srvs/srv/SetBool")
    values = one.add_mutually_exclusive_group()
    values.add_argument(
        "values",
        nargs="?",
        default="{}",
        help="YAML, as '{a: 1, b: 2}'; fields that are not given keep their default",
    )
    values.add_argument("--stdin", action="store_true", help="read the values from standard input")
    one.add_argument(
        "-r", "--rate", metavar="N", type=positive_float, help="call again and again, at N Hz"
    )
    one.add_argument(
        "--timeout",
        metavar="N",
        type=positive_float,
        default=5.0,
        help="seconds to wait for the service to come up (default: 5)",
    )

    one = verbs.add("type", run_type, "print a service's type")
    one.add_argument("service_name", help="name of the service")

    one = verbs.add("info", run_info, "tell a service's type, and how many serve and call it")
    one.add_argument("service_name", help="name of the service")

    one = verbs.add("find", run_find, "list the services of a type")
    one.add_argument("service_type", help="the type, as std_srvs/srv/SetBool")
    one.add_argument("-c", "--count-services", action="store_true", help="only how many")
    one.add_argument("--include-hidden-services", action="store_true", help="hidden ones as well")


def run_list(args: argparse.Namespace) -> None:
    """Print the services."""
    with graph_node(args) as node:
        services = visible(node.get_service_names_and_types(), args.include_hidden_services)
    if args.count_services:
        print(len(services))
    else:
        for name, types in services:
            print(f"{name} [{', '.join(types)}]" if args.show_types else name)


def run_type(args: argparse.Namespace) -> None:
    """Print the types of a service."""
    with graph_node(args) as node:
        print(*_types_of(node, full_name(node, args.service_name)), sep="\n")


def _types_of(node: Any, name: str) -> list[str]:
    return types_of(node, "service", name, node.get_service_names_and_types)


def run_info(args: argparse.Namespace) -> None:
    """Print type, clients and servers of a service."""
    with graph_node(args) as node:
        name = full_name(node, args.service_name)
        types = _types_of(node, name)
        print(f"Type: {types[0] if len(types) == 1 else types}")
        print(f"Clients count: {node.count_clients(name)}")
        print(f"Services count: {node.count_services(name)}")


def run_find(args: argparse.Namespace) -> None:
    """Print the services of a type."""
    with graph_node(args) as node:
        services = visible(node.get_service_names_and_types(), args.include_hidden_services)
    found = [name for name, types in services if args.service_type in types]
    print(len(found) if args.count_services else "\n".join(found), end="\n" if found else "")


def run_call(args: argparse.Namespace) -> None:
    """Call, and print the responses."""
    import rclpy

    values = read_values(args.values, args.stdin)
    with graph_node(args, settle=False) as node:
        name = full_name(node, args.service_name)
        kind = service_type(args.service_type)
        request = kind.Request()
        fill(request, values)
        wait_for_type(
            node,
            "service",
            name,
            full_type_name(args.service_type, "srv"),
            node.get_service_names_and_types,
            args.timeout,
            notice="waiting for service to become available...",
        )
        client = node.create_client(kind, name)
        if not spin_until(node, client.service_is_ready, args.timeout):
            raise CcrError(f"service {name!r} has clients, but no server")
        while True:
            started = time.monotonic()
            print(f"requester: making request: {request!r}\n")
            response = client.call_async(request)
            rclpy.spin_until_future_complete(node, response)
            if not response.done():  # a signal has ended rclpy
                return
            print(f"response:\n{response.result()!r}\n")
            if args.rate is None:
                return
            time.sleep(max(0.0, started + 1.0 / args.rate - time.monotonic()))
