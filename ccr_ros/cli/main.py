# SPDX-License-Identifier: Apache-2.0
"""Entry point of ``ccr``: finds the command, imports its module only, and runs it.

A command module has a docstring (its help), ``add_arguments(parser)`` and
``run(args) -> int``. One whose first argument is a command again has, instead of both,
``COMMANDS``, a table like the one here. One that hands arguments on to another program also
has ``OWN_FLAGS``: arguments from the first that is not among them on are not parsed, but put in
``args.rest``.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections.abc import Sequence
from types import ModuleType

from ccr_ros import __version__
from ccr_ros.blas import use_one_thread
from ccr_ros.model.errors import CcrError

COMMANDS: dict[str, tuple[str, str]] = {
    "demo": (
        "ccr_ros.cli.demo",
        "three fingers grasp a ball, or turn a cube; leaves a replay",
    ),
    "test": ("ccr_ros.cli.test", "run the linters, the type checker and the tests"),
    "solve": ("ccr_ros.cli.solve", "solve one finger for given cable pulls"),
    "grasp": ("ccr_ros.cli.grasp", "close a gripper on an object and see how it is held"),
    "design": (
        "ccr_ros.cli.design",
        "rest shapes, routings, pulls and grippers for a wanted shape",
    ),
    "bench": ("ccr_ros.cli.bench", "measure speed and accuracy next to other solvers"),
    "run": ("ccr_ros.cli.run", "run a node"),
    "up": ("ccr_ros.cli.up", "run all nodes of a gripper in one terminal"),
    "gripper": ("ccr_ros.cli.gripper", "grasp, move, rotate and release with a gripper that runs"),
    "topic": ("ccr_ros.cli.ros.topic", "list, echo, publish and measure topics"),
    "node": ("ccr_ros.cli.ros.node", "list nodes, and tell what one has"),
    "service": ("ccr_ros.cli.ros.service", "list and call services"),
    "action": ("ccr_ros.cli.ros.action", "list actions and send goals"),
    "param": ("ccr_ros.cli.ros.param", "list, get and set parameters of nodes"),
    "lifecycle": ("ccr_ros.cli.ros.lifecycle", "tell and change the state of lifecycle nodes"),
    "interface": ("ccr_ros.cli.ros.interface", "list and show message, service and action types"),
}

EXIT_ERROR = 2
EXIT_INTERRUPTED = 130  # 128 + SIGINT, as shells report it


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Args:
        argv: Arguments after the program's name; ``None`` takes them from ``sys.argv``.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    use_one_thread()
    if argv is None and words[:1] == ["run"]:
        from ccr_ros.nodes.entry import end_on_signals

        end_on_signals()  # a node may be told to end while it loads
    try:
        code = _dispatch(words)
        sys.stdout.flush()  # so that a broken pipe is met here, not while exiting
        return code
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED
    except BrokenPipeError:
        # Whoever read our output has gone (as `| head` does): nothing is left to say.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except CcrError as error:
        print(f"ccr: error: {error}", file=sys.stderr)
        return EXIT_ERROR


def _dispatch(argv: list[str]) -> int:
    return _run_one_of(
        COMMANDS,
        "ccr",
        argparse.ArgumentParser(
            prog="ccr",
            usage="ccr COMMAND ...",
            description="Grippers with cable-driven continuum fingers.",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        ),
        argv,
    )


def _run_one_of(
    commands: dict[str, tuple[str, str]],
    name: str,
    parser: argparse.ArgumentParser,
    argv: list[str],
) -> int:
    """Run the command of a table that the arguments begin with; its module alone is imported."""
    width = max(10, *(len(command) for command in commands))
    parser.epilog = (
        "commands:\n"
        + "\n".join(f"  {command:<{width}} {text}" for command, (_, text) in commands.items())
        + f"\n\n`{name} COMMAND --help` tells more."
    )
    if name == "ccr":
        parser.add_argument("--version", action="version", version=f"ccr_ros {__version__}")
    parser.add_argument("command", nargs="?", help=argparse.SUPPRESS)
    parser.add_argument("rest", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    top = parser.parse_args(argv)
    if top.command is None:
        parser.print_help()
        return 0
    if top.command not in commands:
        parser.error(f"unknown command {top.command!r}; valid: {', '.join(commands)}")

    module_name, summary = commands[top.command]
    module = importlib.import_module(module_name)
    # REMAINDER would lose a leading `--`: take the command's arguments as they were given.
    rest = argv[argv.index(top.command) + 1 :]
    below = argparse.ArgumentParser(
        prog=f"{name} {top.command}",
        description=_help_of(module, summary),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    table: dict[str, tuple[str, str]] | None = getattr(module, "COMMANDS", None)
    if table is not None:
        below.usage = f"{below.prog} COMMAND ..."
        return _run_one_of(table, below.prog, below, rest)
    args = _parse(below, module, rest)
    return int(module.run(args) or 0)


def _parse(
    parser: argparse.ArgumentParser, module: ModuleType, argv: list[str]
) -> argparse.Namespace:
    module.add_arguments(parser)
    own_flags: tuple[str, ...] | None = getattr(module, "OWN_FLAGS", None)
    if own_flags is None:
        return parser.parse_args(argv)
    known = {*own_flags, "-h", "--help"}
    cut = next((i for i, word in enumerate(argv) if word not in known), len(argv))
    args = parser.parse_args(argv[:cut])
    args.rest = argv[cut:]
    args.usage_error = parser.error
    return args


def _help_of(module: ModuleType, summary: str) -> str:
    """Return the part of the module's docstring that is for users, else the one-line help."""
    return (module.__doc__ or "").strip() or summary
