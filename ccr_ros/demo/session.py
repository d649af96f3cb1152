# SPDX-License-Identifier: Apache-2.0
"""The demo from start to end: nodes started, watched, recorded; files and figures left."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ccr_ros.model import load_gripper
from ccr_ros.resources import find_config
from ccr_ros.runtime import enable_ros
from ccr_ros.stack.environment import graph_environment
from ccr_ros.stack.parts import Part, StackFailed, Started, Starter
from ccr_ros.stack.processes import SignalGuard
from ccr_ros.stack.starter import starter_of_nodes
from ccr_ros.viz.figures import force_unit
from ccr_ros.viz.recording import Recording

from .measurements import Report
from .output import prepare_folder, write_files
from .progress import Progress
from .script import GRIPPER_FILE, PullScript

if TYPE_CHECKING:
    from .recorder import Recorder

NAMESPACE = "/gripper"
SOLVER = Part(
    "solver_node", ("ccr_ros.cli", "run", "solver_node"), "ccr_ros.nodes.solver_node:spin"
)
PULLER = Part("pull_publisher", ("ccr_ros.demo",), "ccr_ros.demo.pull_publisher:play")

_START_TIMEOUT = 30.0  # s until the solver's first poses, and from these to the first pulls
_SILENCE_TIMEOUT = 5.0  # s without any pose while pulls are published
_END_TIMEOUT = 10.0  # s that the publisher may take longer than its script
_SETTLE = 3.0  # s at most, for the last poses to arrive
_LOOK_EVERY = 0.1  # s between looks at the processes and updates of the progress line


def run_demo(folder: Path, seconds: float, progress: Progress) -> list[Path]:
    """Run the demo; return the paths of the files it has left.

    Args:
        folder: Where to leave them.
        seconds: How long the fingers move [s].
        progress: Told what happens.

    Raises:
        StackFailed: A node did not appear, ended or fell silent, or another one is in the way.
        InvalidFile: A file cannot be written.
        InvalidValue: The time is out of its range.
        RuntimeMissing: There is no rclpy.
    """
    gripper = load_gripper(find_config(GRIPPER_FILE))
    script = PullScript(gripper.finger_names, seconds)
    prepare_folder(folder)
    os.environ.update(graph_environment(os.environ))
    embedded = enable_ros()
    with SignalGuard() as signals:
        started = time.monotonic()
        with signals.held():
            session = _Session(script, progress, signals)
            with starter_of_nodes(NAMESPACE) as starter:
                recording, report = session.run(gripper, embedded, starter)
        unit = force_unit(recording.forces_are)
        progress.say(f"the fingers have moved ({time.monotonic() - started:.1f} s); measured:")
        progress.say("\n".join(f"  {line}" for line in report.lines(unit)))
        progress.update("writing", str(folder))
        paths = write_files(folder, recording, progress.say)
        progress.clear()
    return paths


class _Session:
    """Two nodes and the recorder, for the time of one script."""

    def __init__(self, script: PullScript, progress: Progress, signals: SignalGuard) -> None:
        self._script = script
        self._progress = progress
        self._signals = signals

    def run(self, gripper: Any, embedded: bool, starter: Starter) -> tuple[Recording, Report]:
        """Play the script and return what was recorded and measured."""
        remap = ("--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", f"gripper_file:={GRIPPER_FILE}")
        seconds = ("-p", f"seconds:={float(self._script.seconds)!r}")
        solver = starter.start(SOLVER, *remap)
        puller = starter.start(PULLER, *remap, *seconds)
        self._progress.say(_introduction(embedded, solver, puller))
        recorder, executor, context = _join(gripper)
        try:
            self._watch(executor, recorder, solver, puller)
        finally:
            executor.shutdown()
            context.try_shutdown()
        report = recorder.measurements.report(_pulls_sent(puller))
        if report.stale:
            self._progress.say(f"{solver.name} could not solve all pulls; {solver.last_words()}")
        return recorder.recording(), report

    def _watch(self, executor: Any, recorder: Recorder, solver: Started, puller: Started) -> None:
        """Spin until the publisher has ended and its last pulls are answered."""
        state_count, last_pose = 0, time.monotonic()
        started = last_look = last_pose
        while puller.exit_code is None:
            executor.spin_once(timeout_sec=_LOOK_EVERY)
            self._signals.check()
            now = time.monotonic()
            if now - last_look < _LOOK_EVERY:
                continue
            last_look = now
            if solver.exit_code is not None:
                raise solver.ended()
            if recorder.state_count != state_count:
                state_count, last_pose = recorder.state_count, now
            self._check_progress(recorder, solver, puller, now - started, now - last_pose)
            self._show(recorder)
        if puller.exit_code != 0 or recorder.elapsed is None:
            raise puller.ended()
        deadline = time.monotonic() + _SETTLE
        while not recorder.measurements.caught_up and time.monotonic() < deadline:
            executor.spin_once(timeout_sec=0.02)
            self._signals.check()
        if recorder.measurements.unanswered:
            silent = ", ".join(recorder.measurements.unanswered)
            raise solver.failure(f"answered no pulls of {silent}")

    def _check_progress(
        self, recorder: Recorder, solver: Started, puller: Started, running: float, silence: float
    ) -> None:
        """Raise if a process takes longer than it should."""
        if rivals := recorder.rivals():
            raise StackFailed(
                f"other nodes publish {', '.join(rivals)} in ROS domain "
                f"{os.environ['ROS_DOMAIN_ID']}; end them, or set ROS_DOMAIN_ID to another"
            )
        elapsed = recorder.elapsed
        if elapsed is None:
            if running > _START_TIMEOUT and not recorder.complete:
                raise solver.failure(f"did not publish its poses within {_START_TIMEOUT:g} s")
            if running > 2 * _START_TIMEOUT:
                raise puller.failure("did not publish any pulls")
        elif silence > _SILENCE_TIMEOUT and elapsed < self._script.seconds:
            raise solver.failure(f"has published no pose for {_SILENCE_TIMEOUT:g} s")
        elif elapsed > self._script.seconds + _END_TIMEOUT:
            raise puller.failure("did not end when its script did")

    def _show(self, recorder: Recorder) -> None:
        elapsed = recorder.elapsed
        if elapsed is None:
            waiting = "the pulls" if recorder.complete else "the solver node"
            self._progress.update("starting", f"waiting for {waiting}")
            return
        seen = recorder.glimpses().values()
        # Within 80 columns for three fingers.
        words = (
            f"{min(elapsed, self._script.seconds):4.1f} s",
            f"pull {_row(f'{max(g.pull, 0.0):3.1f}' for g in seen)} %",
            f"tip {_row(f'{g.tip_height * 1e3:3.0f}' for g in seen)} mm",
            f"{_row(f'{g.tension:3.1f}' for g in seen)} N",
            f"touch {sum(g.contacts for g in seen)}",
        )
        self._progress.update(self._script.phase(elapsed), "  ".join(words))


def _join(gripper: Any) -> tuple[Recorder, Any, Any]:
    """Join the ROS graph with a recorder; return it, its executor and its context."""
    import rclpy
    from rclpy.context import Context
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.signals import SignalHandlerOptions

    from .recorder import Recorder

    context = Context()
    rclpy.init(args=[], context=context, signal_handler_options=SignalHandlerOptions.NO)
    recorder = Recorder(gripper, context=context, namespace=NAMESPACE)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(recorder)
    return recorder, executor, context


def _row(texts: Iterable[str]) -> str:
    return " ".join(texts)


def _introduction(embedded: bool, solver: Started, puller: Started) -> str:
    runtime = "embedded rclpy" if embedded else f"ROS 2 {os.environ.get('ROS_DISTRO', '')}".strip()
    domain = os.environ["ROS_DOMAIN_ID"]
    return (
        f"{runtime}, ROS_DOMAIN_ID {domain}, namespace {NAMESPACE}\n"
        f"started {solver.name} ({solver.where}) and {puller.name} ({puller.where})"
    )


def _pulls_sent(puller: Started) -> int:
    for line in reversed(puller.output.splitlines()):
        if line.startswith("{"):
            return int(json.loads(line)["pulls_sent"])
    raise puller.failure("did not say what it had sent")
