# SPDX-License-Identifier: Apache-2.0
"""Run all nodes of a gripper in one terminal: solver, servo bridge and coordinator.

GRIPPER is a gripper file or the name of one in config/ (default: gripper_sphere). What the nodes
write is shown with their names. Ctrl-C ends them in order. A node that ends by itself is told of;
the others go on (the servo bridge holds what is held), and nothing is restarted without
--restart, which tells each time. To run single nodes: `ccr run`. Exit code: 0 ended by Ctrl-C and
nothing had failed, 1 a node had ended by itself, 2 bad input.

  ccr up
  ccr up my_gripper.yaml --servos my_servos.yaml --driver dynamixel --namespace /left
  ccr up --mode gripper
  ccr up --without gripper_coordinator_node --params my_parameters.yaml
"""

from __future__ import annotations

import argparse
import sys
import threading
from pathlib import Path

from ccr_ros.model.errors import InvalidFile, InvalidValue

DRIVERS = ("loopback", "ros2_control", "dynamixel")
MODES = ("fingers", "gripper")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument(
        "gripper", nargs="?", default="gripper_sphere", metavar="GRIPPER", help="gripper file"
    )
    parser.add_argument(
        "--servos", metavar="FILE", help="servo file (default: the servo bridge's own default)"
    )
    parser.add_argument(
        "--driver",
        metavar="NAME",
        help=f"how servos are reached: {', '.join(DRIVERS)} (default: loopback, simulated servos)",
    )
    parser.add_argument(
        "--mode",
        metavar="NAME",
        help="solver node: fingers (default), each by itself, or gripper, with the object in hand",
    )
    parser.add_argument("--namespace", metavar="NS", default="/gripper", help="default: /gripper")
    parser.add_argument(
        "--params", metavar="FILE", action="append", default=[], help="ROS 2 parameter file"
    )
    parser.add_argument(
        "--without", metavar="NODE", action="append", default=[], help="leave a node out"
    )
    parser.add_argument(
        "--restart", action="store_true", help="start a node again that ends by itself"
    )


def run(args: argparse.Namespace) -> int:
    """Run the nodes until told to end; return the exit code.

    Raises:
        CcrError: A file is not found or not valid, or a name is none.
    """
    from ccr_ros.model import UnknownName, load_gripper
    from ccr_ros.resources import find_config
    from ccr_ros.runtime import enable_ros
    from ccr_ros.stack.processes import SignalGuard
    from ccr_ros.stack.starter import starter_of_nodes
    from ccr_ros.stack.up import NODES, Plan, Stack, arguments_for, keep_up, node_part

    for name in args.without:
        if name not in NODES:
            raise UnknownName("node", name, NODES)
    chosen = [name for name in NODES if name not in args.without]
    if not chosen:
        raise InvalidValue("--without", ", ".join(args.without), "not all of the nodes")
    if args.driver is not None and args.driver not in DRIVERS:
        raise UnknownName("driver", args.driver, DRIVERS)
    if args.mode is not None and args.mode not in MODES:
        raise UnknownName("mode", args.mode, MODES)
    namespace = "/" + args.namespace.strip("/")
    # What is wrong with a file is told here and once, not by each node.
    gripper = find_config(args.gripper)
    load_gripper(gripper)
    for file in args.params:
        if not Path(file).is_file():
            raise InvalidFile(file, "there is no such file")
    own: dict[str, dict[str, object]] = {name: {"gripper_file": str(gripper)} for name in chosen}
    if "servo_bridge_node" in own:
        if args.servos is not None:
            own["servo_bridge_node"]["servo_file"] = str(find_config(args.servos))
        if args.driver is not None:
            own["servo_bridge_node"]["driver"] = args.driver
    if "solver_node" in own and args.mode is not None:
        own["solver_node"]["mode"] = args.mode
    plan = Plan(
        parts=tuple(node_part(name) for name in chosen),
        arguments={n: arguments_for(namespace, p, args.params, ()) for n, p in own.items()},
        restart=args.restart,
    )
    enable_ros()
    terminal = threading.Lock()  # nodes write from threads of their own

    def say(text: str, source: str = "ccr") -> None:
        with terminal:
            print(f"[{source}] {text}", flush=True)

    with SignalGuard() as signals:
        try:
            with starter_of_nodes(namespace, lambda name, line: say(line, name)) as starter:
                stack = Stack(plan, starter, say)
                try:
                    code = keep_up(stack, signals)
                except KeyboardInterrupt:
                    say("ending all nodes")
                    code = 1 if stack.failed else 0
        except BrokenPipeError:
            sys.stderr.write("ccr: nobody reads the output any more; all nodes have ended\n")
            code = 1
    return code
