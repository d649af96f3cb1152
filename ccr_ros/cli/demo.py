# SPDX-License-Identifier: Apache-2.0
"""The paper's grippers at work, with simulated servos.

ccr demo: three pre-bent fingers close on a ball of 112 mm, hold it while it gets heavier, and let
it go at a set time. ccr demo cube: three fingers grasp a cube of 40 mm, carry it and turn it 20 deg
to either side, put it down and let it go. All of it goes through the real nodes, topics and
actions, as processes of their own, in a ROS domain of their own (unless ROS_DOMAIN_ID is set).
Without ROS 2 and cyclonedds, all run in one process.

It leaves, in DIR: replay.html (open it in a browser), strip.png and recording.json; and prints what
was measured. Exit code: 0 done, 1 a node failed, 2 bad input.
"""

from __future__ import annotations

import argparse
import sys
import webbrowser
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument(
        "what", nargs="?", default="sphere", help="sphere (default) or cube: what is grasped"
    )
    parser.add_argument("--out", metavar="DIR", default="demo", help="folder (default: demo)")
    parser.add_argument(
        "--hold", metavar="S", default="10", help="how long it is held (default: 10 s)"
    )
    parser.add_argument(
        "--record", metavar="FILE.mcap", help="record all topics, for Foxglove and ros2 bag"
    )
    parser.add_argument(
        "--headless",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="--no-headless: open the replay in a browser at the end",
    )


def run(args: argparse.Namespace) -> int:
    """Run the demo and return the exit code.

    Raises:
        InvalidFile, InvalidValue: A place cannot be written to, or the time is out of range.
    """
    # Here, so that `ccr demo --help` stays quick.
    from ccr_ros.demo.kinds import demo_kind
    from ccr_ros.demo.progress import Progress
    from ccr_ros.demo.session import run_demo
    from ccr_ros.stack.parts import StackFailed

    progress = Progress(sys.stdout)
    try:
        kind = demo_kind(args.what)
        paths = run_demo(kind, Path(args.out), _number(args.hold), progress, args.record)
    except StackFailed as error:
        progress.clear()
        print(f"ccr: error: {error}", file=sys.stderr)
        return 1
    except (KeyboardInterrupt, SystemExit):
        progress.clear()
        print("ccr: interrupted; what the demo had started has ended", file=sys.stderr)
        raise
    except BaseException:
        progress.clear()
        raise
    print("look at:")
    for path in paths:
        print(f"  {path}")
    replay = next(path for path in paths if path.suffix == ".html")
    if not args.headless and not webbrowser.open(replay.resolve().as_uri()):
        print(f"no browser could be opened; open {replay} yourself")
    return 0


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        from ccr_ros.model import InvalidValue

        raise InvalidValue("--hold", text, "a number of seconds") from None
