# SPDX-License-Identifier: Apache-2.0
"""Entry point of ``ccr``: finds the command, imports its module only, and runs it.

A command module has a docstring (its help), ``add_arguments(parser)`` and
``run(args) -> int``. One that hands arguments on to another program also has ``OWN_FLAGS``:
arguments from the first that is not among them on are not parsed, but put in ``args.rest``.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections.abc import Sequence
from types import ModuleType

from ccr_ros import __version__
from ccr_ros.model.errors import CcrError

COMMANDS: dict[str, tuple[str, str]] = {
    "demo": ("ccr_ros.cli.demo", "three fingers move on a ROS graph; leaves pictures and a replay"),
    "test": ("ccr_ros.cli.test", "run the linters, the type checker and the tests"),
    "solve": ("ccr_ros.cli.solve", "solve one finger for given cable pulls"),
    "bench": ("ccr_ros.cli.bench", "measure speed and accuracy next to other solvers"),
    "run": ("ccr_ros.cli.run", "run a node"),
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
    parser = argparse.ArgumentParser(
        prog="ccr",
        usage="ccr COMMAND ...",
        description="Grippers with cable-driven continuum fingers.",
        epilog="commands:\n"
        + "\n".join(f"  {name:<10} {text}" for name, (_, text) in COMMANDS.items())
        + "\n\n`ccr COMMAND --help` tells more.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"ccr_ros {__version__}")
    parser.add_argument("command", nargs="?", help=argparse.SUPPRESS)
    parser.add_argument("rest", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    top = parser.parse_args(argv)
    if top.command is None:
        parser.print_help()
        return 0
    if top.command not in COMMANDS:
        parser.error(f"unknown command {top.command!r}; valid: {', '.join(COMMANDS)}")

    module_name, summary = COMMANDS[top.command]
    module = importlib.import_module(module_name)
    # REMAINDER would lose a leading `--`: take the command's arguments as they were given.
    args = _parse(top.command, summary, module, argv[argv.index(top.command) + 1 :])
    return int(module.run(args) or 0)


def _parse(name: str, summary: str, module: ModuleType, argv: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog=f"ccr {name}",
        description=_help_of(module, summary),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
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
