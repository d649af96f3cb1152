# SPDX-License-Identifier: Apache-2.0
import argparse
import os
import subprocess
import sys
import types
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

import ccr_ros
from ccr_ros.cli import main as cli
from ccr_ros.cli import run as run_command
from ccr_ros.cli import test as test_command
from ccr_ros.model.errors import CcrError

ROOT = Path(__file__).resolve().parents[1]


def ccr(*args, **options):
    command = [sys.executable, "-P", "-m", "ccr_ros.cli", *args]
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT / "test", **options)


@pytest.fixture
def command(monkeypatch):
    """Return a function that puts a command `try` into the table, and the list of its calls."""
    calls = []

    def install(run=lambda args: 0, **attributes):
        module = types.ModuleType("ccr_try", "What it is for.")
        module.add_arguments = lambda parser: parser.add_argument("--flag", action="store_true")
        module.run = lambda args: (calls.append(args), run(args))[1]
        module.__dict__.update(attributes)
        monkeypatch.setitem(sys.modules, "ccr_try", module)
        monkeypatch.setitem(cli.COMMANDS, "try", ("ccr_try", "tries"))
        return calls

    return install


def fail_with(error):
    def run(args):
        raise error

    return run


def test_help_lists_every_command():
    shown = ccr("--help")
    assert shown.returncode == 0
    for name in ("demo", "test", "solve", "bench", "run"):
        assert f"  {name} " in shown.stdout


def test_without_arguments_help_is_shown(capsys):
    assert cli.main([]) == 0
    assert "commands:" in capsys.readouterr().out


def test_version():
    assert ccr("--version").stdout.strip() == f"ccr_ros {ccr_ros.__version__}"


def test_start_up_loads_nothing_heavy():
    code = (
        "import sys, ccr_ros.cli.main as m\n"
        "try: m.main(['--help'])\n"
        "except SystemExit: pass\n"
        "print({'numpy', 'casadi', 'rclpy', 'yaml'} & set(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.stderr.strip() == "set()"


def test_unknown_commands_list_the_valid_ones():
    done = ccr("slove")
    assert done.returncode == 2
    assert "'slove'" in done.stderr and "solve" in done.stderr


def test_a_commands_code_is_the_exit_code(command):
    calls = command(run=lambda args: 3)
    assert cli.main(["try", "--flag"]) == 3
    assert calls[0].flag is True


def test_errors_of_the_package_are_one_line_and_code_2(command, capsys):
    command(run=fail_with(CcrError("finger 'a': no such cable")))
    assert cli.main(["try"]) == 2
    assert capsys.readouterr().err == "ccr: error: finger 'a': no such cable\n"


def test_other_errors_keep_their_traceback(command):
    command(run=fail_with(ZeroDivisionError()))
    with pytest.raises(ZeroDivisionError):
        cli.main(["try"])


def test_ctrl_c_gives_130(command):
    command(run=fail_with(KeyboardInterrupt()))
    assert cli.main(["try"]) == 130


def test_a_broken_pipe_is_quiet():
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "ccr_ros.cli"]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, cwd=ROOT)
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, b"")


def test_own_flags_end_at_the_first_other_word(command):
    calls = command(OWN_FLAGS=("--flag",))
    cli.main(["try", "--flag", "x", "--flag", "--", "--ros-args", "-p", "a:=1", "--"])
    assert calls[0].flag is True
    assert calls[0].rest == ["x", "--flag", "--", "--ros-args", "-p", "a:=1", "--"]


def test_unknown_nodes_list_the_valid_ones():
    done = ccr("run", "solver")
    assert done.returncode == 2
    assert "'solver'" in done.stderr and "solver_node" in done.stderr


def test_run_without_node_is_a_usage_error():
    done = ccr("run")
    assert done.returncode == 2
    assert "usage: ccr run" in done.stderr and "solver_node" in done.stderr


def test_run_hands_everything_on_to_the_node(monkeypatch):
    seen = []
    module = types.ModuleType("ccr_try")
    module.main = lambda: seen.append(sys.argv) or 7
    monkeypatch.setitem(sys.modules, "ccr_try", module)
    entry = EntryPoint("try_node", "ccr_try:main", "console_scripts")
    monkeypatch.setattr(run_command, "node_entry_points", lambda: {"try_node": entry})
    monkeypatch.setattr(sys, "argv", ["ccr"])
    args = argparse.Namespace(rest=["try_node", "--help", "--ros-args", "-p", "x:=1", "--"])
    assert run_command.run(args) == 7
    assert seen == [["try_node", "--help", "--ros-args", "-p", "x:=1", "--"]]


@pytest.mark.parametrize(("lint", "outcome", "code"), [(0, "", 0), (1, "", 1), (0, "assert 0", 1)])
def test_test_runs_every_tool_and_ends_with_the_count(
    monkeypatch, tmp_path, capfd, lint, outcome, code
):
    (tmp_path / "test_it.py").write_text(f"def test_it():\n    {outcome or 'pass'}\n")
    monkeypatch.setattr(test_command, "_checkout", lambda: tmp_path)
    monkeypatch.setattr(
        test_command,
        "_lint_commands",
        lambda: {"lint": [sys.executable, "-c", f"raise SystemExit({lint})"]},
    )
    args = argparse.Namespace(fast=False, no_lint=False, rest=["-n0", "-p", "no:cacheprovider"])
    assert test_command.run(args) == code
    lines = capfd.readouterr().out.splitlines()
    assert lines[-1].startswith("1 failed in" if outcome else "1 passed in")
    assert ("FAILED" in "".join(lines[-3:])) == (code != 0)


@pytest.mark.parametrize("word", ["-n0", "--pdb", "--co", "-s", "--dist=no"])
def test_workers_are_left_to_who_asks_for_them(monkeypatch, word):
    monkeypatch.setattr(os, "cpu_count", lambda: 8)
    assert test_command._pytest_command(False, [word]).count("-n") == 0
    assert test_command._pytest_command(False, ["-k", "no"]).count("-n") == 1


def test_fast_leaves_out_long_tests():
    assert "not long" in test_command._pytest_command(True, [])
    assert "not long" not in test_command._pytest_command(False, [])


def test_test_says_where_the_tests_are(monkeypatch, tmp_path):
    monkeypatch.setattr(test_command, "__file__", str(tmp_path / "ccr_ros" / "cli" / "test.py"))
    with pytest.raises(CcrError, match="in the repository"):
        test_command._checkout()


def test_sources_are_compiled_once_and_not_where_the_user_wants_none(monkeypatch):
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    environment = test_command._pytest_environment("/scratch")
    assert "PYTHONDONTWRITEBYTECODE" not in environment
    assert environment["PYTHONPYCACHEPREFIX"] == "/scratch"
    monkeypatch.delenv("PYTHONDONTWRITEBYTECODE")
    assert test_command._pytest_environment("/scratch") == dict(os.environ)
