# SPDX-License-Identifier: Apache-2.0
"""The verbs of a noun, as sub-commands: ``ccr NOUN VERB ...``."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from io import TextIOWrapper

from ccr_ros.runtime import enable_ros

Run = Callable[[argparse.Namespace], int | None]


class Verbs:
    """Collects the verbs of one noun in its parser."""

    def __init__(self, parser: argparse.ArgumentParser) -> None:
        parser.set_defaults(verb=None, print_help=parser.print_help)
        self._verbs = parser.add_subparsers(metavar="VERB", title="verbs")

    def add(
        self, name: str, run: Run, summary: str, *, graph: bool = True
    ) -> argparse.ArgumentParser:
        """Add a verb and return its parser, for its arguments.

        Args:
            name: The word on the command line.
            run: Does it; its result is the exit code, None standing for 0.
            summary: One line of help.
            graph: Whether it joins the ROS graph, and takes the options of that.
        """
        parser = self._verbs.add_parser(name, help=summary, description=summary.capitalize() + ".")
        parser.set_defaults(verb=run)
        if graph:
            parser.add_argument(
                "--spin-time",
                type=positive_float,
                metavar="SECONDS",
                help="look for others this long (default: until nothing new shows up any more)",
            )
            parser.add_argument(
                "-s", "--use-sim-time", action="store_true", help="take the time from /clock"
            )
            # Scripts written for ros2 may say it. There never is a daemon here.
            parser.add_argument("--no-daemon", action="store_true", help=argparse.SUPPRESS)
        return parser


def run_verb(args: argparse.Namespace) -> int:
    """Run the chosen verb, with rclpy at hand and output that reaches a pipe line by line.

    Raises:
        CcrError: ROS is not there, or the verb found something wrong with what was asked for.
    """
    if args.verb is None:
        args.print_help()
        return 0
    # Values that a person typed are checked on real ROS as well, which by default does not.
    os.environ.setdefault("ROS_PYTHON_CHECK_FIELDS", "1")
    enable_ros()
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)
    return args.verb(args) or 0


def positive_float(text: str) -> float:
    """Read a number above 0, for argparse."""
    return _checked(text, float, lambda value: 0 < value < float("inf"), "a number above 0")


def positive_int(text: str) -> int:
    """Read a whole number above 0, for argparse."""
    return _checked(text, int, lambda value: value > 0, "a whole number above 0")


def natural(text: str) -> int:
    """Read a whole number from 0 up, for argparse."""
    return _checked(text, int, lambda value: value >= 0, "a whole number, 0 or more")


def _checked(text: str, kind: type, allowed: Callable[[float], bool], words: str):  # type: ignore[no-untyped-def]
    try:
        value = kind(text)
    except ValueError:
        value = float("nan")
    if not allowed(value):
        raise argparse.ArgumentTypeError(f"{text!r} is not allowed; must be {words}")
    return value
