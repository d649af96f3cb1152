# SPDX-License-Identifier: Apache-2.0
"""The demo from start to end: nodes started, watched, recorded; files and figures left."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ccr_ros.model import Gripper, load_gripper
from ccr_ros.runtime import enable_ros
from ccr_ros.stack.bag import BagWriter, checked_bag_path
from ccr_ros.stack.environment import graph_environment
from ccr_ros.stack.parts import StackFailed, Started, Starter
from ccr_ros.stack.processes import SignalGuard
from ccr_ros.stack.starter import starter_of_nodes
from ccr_ros.stack.up import NODES, arguments_for, node_part
from ccr_ros.viz.figures import force_unit
from ccr_ros.viz.recording import Recording

from .kinds import DemoKind
from .measurements import Report
from .output import prepare_folder, write_files
from .progress import Progress
from .scene import checked_hold

if TYPE_CHECKING:
    from .recorder import Recorder
    from .story import Story

NAMESPACE = "/gripper"

_PATIENCE = 5.0  # s of silence that nodes bear: nobody's object falls, and the machine may be busy
_SILENCE_TIMEOUT = 10.0  # s without any pose once there was one
_LOOK_EVERY = 0.1  # s between looks at the processes and updates of the progress line


def run_demo(
    kind: DemoKind, folder: Path, hold: float, progress: Progress, record: str | None
) -> list[Path]:
    """Run a demo; return the paths of the files it has left.

    Args:
        kind: Which.
        folder: Where to leave them.
        hold: How long the object is held [s].
        progress: Told what happens.
        record: File in which all topics are recorded (MCAP), or None.

    Raises:
        StackFailed: A node did not appear, refused, ended or fell silent, or another is in the way.
        InvalidFile: A file cannot be written.
        InvalidValue: The time is out of its range.
        MissingMcap: A recording is wanted, and its library is not installed.
        RuntimeMissing: There is no rclpy.
    """
    hold = checked_hold(hold)
    bag_path = None if record is None else checked_bag_path(record)
    prepare_folder(folder)
    gripper_file, about = kind.gripper(folder)
    gripper = load_gripper(gripper_file)
    progress.say(about)
    os.environ.update(graph_environment(os.environ))
    embedded = enable_ros()
    with SignalGuard() as signals:
        started = time.monotonic()
        bag = nullcontext() if bag_path is None else BagWriter(bag_path)
        with (
            signals.held(),
            tempfile.TemporaryDirectory(prefix="ccr_demo_") as scratch,
            bag as writer,
            starter_of_nodes(NAMESPACE) as starter,
        ):
            nodes = _start(kind, starter, gripper_file, Path(scratch))
            progress.say(_introduction(embedded, nodes))
            recording, report = _play(kind, gripper, hold, nodes, progress, signals, writer)
        unit = force_unit(recording.forces_are)
        progress.say(f"{kind.done} ({time.monotonic() - started:.1f} s):")
        progress.say("\n".join(f"  {line}" for line in kind.lines(recording)))
        progress.say("measured:")
        progress.say("\n".join(f"  {line}" for line in report.lines(unit)))
        progress.update("writing", str(folder))
        paths = write_files(folder, recording, progress.say, kind.shown)
        progress.clear()
    made = [gripper_file] if gripper_file.name in kind.files else []
    return [*paths, *made] if bag_path is None else [*paths, *made, bag_path]


def _start(kind: DemoKind, starter: Starter, gripper_file: Path, scratch: Path) -> list[Started]:
    """Start the gripper's nodes, and what is there in place of a real object."""
    own: dict[str, dict[str, object]] = {
        "servo_bridge_node": {
            "driver": "loopback",
            "calibration_file": str(scratch / "zeros.yaml"),
            "command_timeout": _PATIENCE,
        },
        "gripper_coordinator_node": dict.fromkeys(
            ("solver_timeout", "bridge_timeout", "stale_timeout"), _PATIENCE
        ),
    }
    shared = {"gripper_file": str(gripper_file.resolve())}
    files = [str(path) for path in kind.parameter_files]
    parts = (*(node_part(name) for name in NODES), kind.world)
    given = {part.name: {**shared, **own.get(part.name, {})} for part in parts}
    return [
        starter.start(part, *arguments_for(NAMESPACE, given[part.name], files, ()))
        for part in parts
    ]


def _play(
    kind: DemoKind,
    gripper: Gripper,
    hold: float,
    nodes: list[Started],
    progress: Progress,
    signals: SignalGuard,
    bag: BagWriter | None,
) -> tuple[Recording, Report]:
    """Play the story, watch the nodes meanwhile; return what was recorded and measured."""
    with _joined(kind, gripper, hold, bag) as (recorder, show, executor):
        last_look = last_pose = time.monotonic()
        state_count = 0
        while not show.done:
            executor.spin_once(timeout_sec=0.02)
            signals.check()
            # First of all, as it may be why the others do not answer.
            for node in nodes:
                if node.exit_code is not None:
                    raise node.ended()
            show.go_on()
            if show.phase != "starting":
                recorder.set_phase(show.phase)
                recorder.begin()
            now = time.monotonic()
            if now - last_look < _LOOK_EVERY:
                continue
            last_look = now
            if recorder.state_count != state_count:
                state_count, last_pose = recorder.state_count, now
            _check(recorder, nodes[0], now - last_pose)
            _show(recorder, show, progress)
        report = recorder.measurements.report()
        if report.stale:
            progress.say(f"{nodes[0].name} could not solve all pulls; {nodes[0].last_words()}")
        return recorder.recording(), report


def _check(recorder: Recorder, solver: Started, silence: float) -> None:
    """Raise if another graph is in the way, or the solver is silent."""
    if rivals := recorder.rivals():
        raise StackFailed(
            f"other nodes publish {', '.join(rivals)} in ROS domain "
            f"{os.environ['ROS_DOMAIN_ID']}; end them, or set ROS_DOMAIN_ID to another"
        )
    if recorder.state_count and silence > _SILENCE_TIMEOUT:
        raise solver.failure(f"has published no pose for {_SILENCE_TIMEOUT:g} s")


def _show(recorder: Recorder, show: Story, progress: Progress) -> None:
    if recorder.elapsed is None:
        progress.update("starting", "waiting for the nodes")
        return
    seen = recorder.glimpses().values()
    # Within 80 columns for three fingers.
    words = (
        f"{recorder.elapsed:4.1f} s",
        f"pull {_row(f'{max(g.pull, 0.0):3.1f}' for g in seen)} %",
        f"{_row(f'{g.tension:3.1f}' for g in seen)} N",
        f"grip {_row(f'{g.force:4.2f}' for g in seen)} N",
    )
    progress.update(show.phase, "  ".join(words))


@contextmanager
def _joined(
    kind: DemoKind, gripper: Gripper, hold: float, bag: BagWriter | None
) -> Iterator[tuple[Recorder, Story, Any]]:
    """Join the ROS graph: with a recorder, and what plays the story."""
    import rclpy
    from rclpy.context import Context
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.signals import SignalHandlerOptions

    from .recorder import Recorder

    context = Context()
    rclpy.init(args=[], context=context, signal_handler_options=SignalHandlerOptions.NO)
    recorder = Recorder(gripper, bag, kind.support, context=context, namespace=NAMESPACE)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(recorder)
    try:
        yield recorder, kind.story(recorder, hold), executor
    finally:
        executor.shutdown()
        context.try_shutdown()


def _row(texts: Iterable[str]) -> str:
    return " ".join(texts)


def _introduction(embedded: bool, nodes: list[Started]) -> str:
    runtime = "embedded rclpy" if embedded else f"ROS 2 {os.environ.get('ROS_DISTRO', '')}".strip()
    lines = [f"{runtime}, ROS_DOMAIN_ID {os.environ['ROS_DOMAIN_ID']}, namespace {NAMESPACE}"]
    return "\n".join([*lines, *(f"started {node.name} ({node.where})" for node in nodes)])
