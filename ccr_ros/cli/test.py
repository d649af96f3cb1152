# SPDX-License-Identifier: Apache-2.0
"""Run ruff, mypy and pytest on a checkout; the exit code is 0 only if all of them pass.

Arguments from the first that is not listed here on go to pytest: `ccr test -k solver`.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import re
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from ccr_ros.model.errors import CcrError
from ccr_ros.runtime import real_ros

OWN_FLAGS = ("--fast", "--no-lint")
TOOLS = ("ruff", "mypy", "pytest")

MAX_WORKERS = 4
# With these, pytest must run in one process, or the user has said how many it shall be.
NO_XDIST = re.compile(r"-n|--numprocesses|--dist|--pdb|--trace|--co$|--collect-only|-s$|--capture")

# pytest plugins that a sourced ROS 2 brings along; they serve launch files given as tests, of
# which there are none here, and break with pytest versions newer than their own.
ROS_PLUGINS = ("launch_ros", "launch_testing", "launch_pytest")

PYTEST_COUNT = re.compile(r"\d+ (passed|failed|error|skipped|deselected)|no tests ran")
ANSI = re.compile(r"\x1b\[[0-9;]*m")


@dataclass(frozen=True)
class Step:
    """One tool's outcome: its name, exit code and wall-clock time in seconds."""

    name: str
    code: int
    seconds: float


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments; the others go to pytest."""
    parser.usage = "ccr test [-h] [--fast] [--no-lint] [PYTEST_ARG ...]"
    parser.add_argument("--fast", action="store_true", help="leave out the tests marked `long`")
    parser.add_argument("--no-lint", action="store_true", help="run pytest only")


def run(args: argparse.Namespace) -> int:
    """Run the tools one after the other, all of them even if one fails."""
    root = _checkout()
    missing = [tool for tool in TOOLS if importlib.util.find_spec(tool) is None]
    if missing:
        raise CcrError(
            f"not installed: {', '.join(missing)}; use ./ccr, or pip install -e '.[dev]'"
        )
    if real_ros() and importlib.util.find_spec("ccr_msgs") is None:
        from ccr_ros.runtime import enable_ros

        enable_ros()  # raises, saying what to do

    steps = []
    if not args.no_lint:
        for name, command in _lint_commands().items():
            _say(name)
            started = time.monotonic()
            lint = subprocess.run(command, cwd=root, env=_lint_environment(), check=False)
            steps.append(Step(name, lint.returncode, time.monotonic() - started))
    _say("pytest")
    started = time.monotonic()
    code, count = _pytest(_pytest_command(args.fast, args.rest), root)
    steps.append(Step("pytest", code, time.monotonic() - started))

    _say("summary")
    for step in steps:
        verdict = "ok" if step.code == 0 else f"FAILED (exit code {step.code})"
        print(f"  {step.name:<12} {step.seconds:6.1f} s  {verdict}")
    print(count, flush=True)
    return 0 if all(step.code == 0 for step in steps) else 1


def _checkout() -> Path:
    """Return the repository's root; the tests are not installed with the package."""
    root = Path(__file__).resolve().parents[2]
    if not (root / "test").is_dir() or not (root / "pyproject.toml").is_file():
        raise CcrError(f"the tests are in the repository, not in this installation ({root})")
    return root


def _lint_commands() -> dict[str, list[str]]:
    python = sys.executable
    return {
        "ruff check": [python, "-m", "ruff", "check", "."],
        "ruff format": [python, "-m", "ruff", "format", "--check", "."],
        "mypy": [python, "-m", "mypy"],
    }


def _lint_environment() -> dict[str, str]:
    """Return an environment without ROS 2's modules: one verdict, wherever the tools run."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}


def _pytest_command(fast: bool, rest: list[str]) -> list[str]:
    command = [sys.executable, "-m", "pytest"]
    # One more than there are cores: many tests wait for other processes or for time to pass.
    workers = min(MAX_WORKERS, (os.cpu_count() or 1) + 1)
    if workers > 1 and not any(NO_XDIST.match(word) for word in rest):
        # By file: fixtures that start processes stay with the tests that share them. In the order
        # of test/conftest.py, which knows what takes long, not by the number of tests.
        command += ["-n", str(workers), "--dist", "loadfile", "--no-loadscope-reorder"]
    if fast:
        command += ["-m", "not long"]
    if real_ros():
        for plugin in ROS_PLUGINS:
            command += ["-p", f"no:{plugin}"]
    if sys.stdout.isatty():
        command.append("--color=yes")
    return command + rest


def _pytest(command: list[str], root: Path) -> tuple[int, str]:
    """Run pytest, show its output as it comes, and return its exit code and counting line."""
    if "--pdb" in command or "--trace" in command:  # needs the terminal for itself
        code = subprocess.run(command, cwd=root, check=False).returncode
        return code, f"pytest ended with exit code {code}"
    count = "pytest printed no count"
    with (
        tempfile.TemporaryDirectory(prefix="ccr_test_") as scratch,
        subprocess.Popen(
            command,
            cwd=root,
            env=_pytest_environment(scratch),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as process,
    ):
        for line in process.stdout or ():
            print(line, end="", flush=True)
            plain = ANSI.sub("", line).strip("= \n")
            if PYTEST_COUNT.search(plain):
                count = plain
    return process.returncode, count


def _pytest_environment(scratch: str) -> dict[str, str]:
    """Return an environment in which compiled sources are kept, if need be for this run alone.

    The tests start hundreds of processes, each of which would compile all that it imports.
    """
    environment = dict(os.environ)
    if environment.pop("PYTHONDONTWRITEBYTECODE", ""):
        environment["PYTHONPYCACHEPREFIX"] = scratch
    return environment


def _say(title: str) -> None:
    print(f"== {title}", flush=True)
