# SPDX-License-Identifier: Apache-2.0
"""The bash script ./ccr, in a copy of its own, with interpreters that only pretend.

A pretended interpreter answers the script's questions, "makes" an environment and "installs"
at once; nothing is downloaded.
"""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
TOOLS = ("bash", "env", "dirname", "basename", "cat", "cksum", "sed", "awk", "tee", "tail", "tr")
TOOLS += ("grep", "mktemp", "rm", "mkdir", "cp", "chmod", "sleep", "readlink", "touch")

FAKE = """#!{bash}
here="{folder}"
case "$1 $2" in
  "-c "*ensurepip*) echo "$FAKE_VERSION {machine} $FAKE_STATE $0"; exit 0 ;;
  "-c "*rclpy*) exit ${{FAKE_RCLPY:-1}} ;;
  "-c "*numpy*) echo 1.26.4; exit 0 ;;
  "-c "*base_prefix*) exit 0 ;;
  "-c "*) exec "{python}" "$@" ;;
  "-m venv")
    for last; do :; done
    mkdir -p "$last/bin" && cp "$0" "$last/bin/python" ;;
  "-m pip")
    echo "$@" >>"$here/pip.txt"
    echo "Collecting numpy<3 (from ccr_ros)"
    if [[ -e "$here/slow" ]]; then
      # exec: were sleep a child, a SIGINT that came just before it started would be lost
      read -r seconds <"$here/slow"; : >"$here/started"; exec sleep "$seconds"
    fi
    [[ ! -e "$here/offline" ]] || {{ echo "ConnectionError: Network is unreachable"; exit 1; }} ;;
  "-P -m") shift 3; printf 'ran'; printf ' <%s>' "$@"; echo " in $PWD" ;;
esac
"""


class Sandbox:
    """A checkout of the script, a PATH with only what it needs, and pretended interpreters."""

    def __init__(self, folder: Path) -> None:
        self.root = folder / "a checkout"
        self.bin = folder / "bin"
        self.home = folder / "home"
        for made in (self.root, self.bin, self.home):
            made.mkdir(parents=True)
        for name in ("ccr", "setup.py", "pyproject.toml"):
            shutil.copy(ROOT / name, self.root)
        for tool in TOOLS:
            (self.bin / tool).symlink_to(shutil.which(tool))
        self.env = {"PATH": str(self.bin), "HOME": str(self.home), "TMPDIR": str(folder)}

    @property
    def venv(self) -> Path:
        return self.root / ".venv"

    def python(self, name: str, version: str, state: str = "Linux ready", machine="x86_64") -> Path:
        text = FAKE.format(
            bash=shutil.which("bash"), folder=self.home, machine=machine, python=sys.executable
        )
        text = text.replace("$FAKE_VERSION", version).replace("$FAKE_STATE", state)
        path = self.bin / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        path.chmod(0o755)
        return path

    def broken_python(self, name: str) -> None:
        path = self.bin / name
        path.write_text(f"#!{shutil.which('bash')}\necho no such version >&2\nexit 127\n")
        path.chmod(0o755)

    def command(self, *args: str) -> list[str]:
        return [str(self.root / "ccr"), *args]

    def run(self, *args: str, code: int = 0, cwd: Path | None = None, **env: str):
        done = subprocess.run(
            self.command(*args),
            env=self.env | env,
            cwd=cwd or self.home,
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert done.returncode == code, done.stdout + done.stderr
        return done

    def start(self, *args: str) -> subprocess.Popen:
        return subprocess.Popen(
            self.command(*args),
            env=self.env,
            cwd=self.home,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def wait_for_pip(self) -> None:
        deadline = time.monotonic() + 60
        while not (self.home / "started").exists():
            assert time.monotonic() < deadline, "pip was never started"
            time.sleep(0.02)

    def pip_calls(self) -> list[str]:
        log = self.home / "pip.txt"
        return log.read_text().splitlines() if log.exists() else []

    def leftovers(self) -> list[str]:
        return sorted(path.name for path in self.root.parent.glob("ccr-install.*"))


@pytest.fixture
def box(tmp_path):
    return Sandbox(tmp_path)


def test_first_use_makes_the_environment_and_second_use_does_not(box):
    box.python("python3.12", "3.12.3")
    first = box.run("solve", "a b", "--pull", "x=4%")
    assert first.stdout == f"ran <solve> <a b> <--pull> <x=4%> in {box.home}\n"  # and nothing else
    assert "making .venv with Python 3.12.3" in first.stderr
    assert "Collecting numpy" in first.stderr
    assert f"-e {box.root}[embedded,all,dev]" in box.pip_calls()[0]

    second = box.run("demo")
    assert second.stderr == ""
    assert len(box.pip_calls()) == 1
    assert box.leftovers() == []


def test_runs_through_links_from_anywhere(box, tmp_path):
    box.python("python3", "3.11.9")
    (tmp_path / "one").symlink_to(box.root / "ccr")
    (box.home / "two").symlink_to("../one")
    done = subprocess.run(
        [box.home / "two", "test"], env=box.env, cwd="/", capture_output=True, text=True
    )
    assert done.stdout == "ran <test> in /\n", done.stderr
    assert box.venv.is_dir()


@pytest.mark.parametrize(
    ("there", "chosen"),
    [
        ({"python3": "3.14.0", "python3.13": "3.13.1", "python3.12": "3.12.0"}, "3.12.0"),
        ({"python3.11": "3.11.2", "python3.13": "3.13.1"}, "3.13.1"),
        ({"python3": "3.10.1", "python3.11": "3.11.2", "python3.14": "3.14.0"}, "3.11.2"),
        ({"python3": "3.12.0rc1", "python3.11": "3.11.2"}, "3.12.0rc1"),
        ({"python": "3.12.4"}, "3.12.4"),
        ({"python3": "3.14.0", "python3.15": "3.15.0"}, "3.14.0"),
    ],
)
def test_the_best_version_is_taken(box, there, chosen):
    for name, version in there.items():
        box.python(name, version)
    assert f"with Python {chosen} (" in box.run("x").stderr


def test_shims_that_do_not_run_are_passed_over(box):
    box.broken_python("python3.12")
    box.broken_python("python3")
    box.python("../home/.pyenv/versions/3.12.1/bin/python3", "3.12.1")
    assert "with Python 3.12.1 (" in box.run("x").stderr


def test_an_interpreter_without_venv_is_passed_over(box):
    box.python("python3.12", "3.12.1", state="Linux novenv")
    box.python("python3.11", "3.11.1")
    assert "with Python 3.11.1 (" in box.run("x").stderr


def test_missing_venv_module_says_what_to_install(box):
    box.python("python3.12", "3.12.1", state="Linux novenv")
    error = box.run("x", code=1).stderr
    assert "cannot make environments" in error
    assert "apt install python3.12-venv" in error


def test_no_suitable_python_says_what_was_found_and_how_to_go_on(box):
    box.python("python3", "3.15.2")
    box.python("python", "3.9.1")
    error = box.run("x", code=1).stderr
    assert "no suitable Python" in error
    assert "3.15" in error and "3.9" in error
    assert "apt install" in error and "PYTHON=" in error
    assert not box.venv.exists()


def test_no_python_at_all(box):
    assert "Found: none" in box.run("x", code=1).stderr


def test_python_overrides_and_a_change_of_it_makes_a_new_environment(box):
    box.python("python3.12", "3.12.1")
    mine = box.python("my python", "3.11.4")
    assert "with Python 3.11.4 (" in box.run("x", PYTHON=str(mine)).stderr
    assert box.run("x").stderr == ""  # stays with what was chosen
    assert "with Python 3.12.1 (" in box.run("x", PYTHON="python3.12").stderr


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("no-such-python", "no such program"),
        ("python3.10", "3.11 or newer is needed"),
        ("broken", "does not run"),
        ("novenv", "apt install python3.12-venv"),
    ],
)
def test_an_override_that_cannot_be_used_says_why(box, value, message):
    box.python("python3.12", "3.12.1")
    box.python("python3.10", "3.10.9")
    box.python("novenv", "3.12.9", state="Linux novenv")
    box.broken_python("broken")
    assert message in box.run("x", code=1, PYTHON=value).stderr


@pytest.mark.parametrize(
    ("version", "machine", "system", "has_wheel"),
    [
        ("3.11.4", "x86_64", "Linux", True),
        ("3.13.1", "arm64", "Darwin", True),
        ("3.12.1", "aarch64", "Linux", False),
        ("3.12.1", "armv7l", "Linux", False),
        ("3.14.0", "x86_64", "Linux", False),
        ("3.15.0rc2", "arm64", "Darwin", False),
    ],
)
def test_where_cyclonedds_has_no_wheel_it_is_said(box, version, machine, system, has_wheel):
    mine = box.python("mine", version, state=f"{system} ready", machine=machine)
    said = box.run("x", PYTHON=str(mine)).stderr
    note = f"note: cyclonedds has no wheel for Python {version} on {system} {machine}; nodes will"
    assert (note in said) is not has_wheel
    assert f"-e {box.root}[embedded,all,dev]" in box.pip_calls()[0]  # setup.py has markers


def test_a_failed_installation_leaves_nothing_and_the_next_run_recovers(box):
    box.python("python3.12", "3.12.1")
    (box.home / "offline").touch()
    error = box.run("x", code=1).stderr
    assert "Network is unreachable" in error and "check the network" in error
    assert not box.venv.exists()
    (log,) = box.leftovers()
    assert log in error
    (box.home / "offline").unlink()
    assert box.run("x").stdout.startswith("ran <x>")


def test_a_failed_update_is_done_again(box):
    box.python("python3.12", "3.12.1")
    box.run("x")
    with open(box.root / "setup.py", "a") as file:
        file.write("# changed\n")
    (box.home / "offline").touch()
    box.run("x", code=1)
    (box.home / "offline").unlink()
    assert box.run("x").stdout.startswith("ran <x>")
    assert len(box.pip_calls()) == 3
    assert box.run("x").stderr == ""


def test_a_change_of_setup_installs_again_into_the_same_environment(box):
    box.python("python3.12", "3.12.1")
    box.run("x")
    (box.venv / "kept").touch()
    with open(box.root / "setup.py", "a") as file:
        file.write("# changed\n")
    assert "has changed: updating .venv" in box.run("x").stderr
    assert len(box.pip_calls()) == 2
    assert (box.venv / "kept").exists()


def test_a_moved_checkout_is_installed_again(box):
    box.python("python3.12", "3.12.1")
    box.run("x")
    box.root = box.root.rename(box.root.with_name("moved"))
    box.run("x")
    assert f"-e {box.root}[" in box.pip_calls()[1]


def test_an_environment_without_stamp_is_made_anew(box):
    # what a killed (SIGKILL) first use leaves
    box.python("python3.12", "3.12.1")
    (box.venv / "bin").mkdir(parents=True)
    (box.venv / "half").touch()
    shutil.copy(box.bin / "python3.12", box.venv / "bin" / "python")
    assert "making .venv" in box.run("x").stderr
    assert not (box.venv / "half").exists()


def test_ctrl_c_leaves_nothing_half_made(box):
    box.python("python3.12", "3.12.1")
    (box.home / "slow").write_text("60\n")
    process = box.start("x")
    box.wait_for_pip()
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130, out + err
    assert "interrupted" in err
    assert not box.venv.exists()
    assert box.leftovers() == []
    (box.home / "slow").unlink()
    assert box.run("x").stdout.startswith("ran <x>")


def test_two_first_uses_at_once_install_once(box):
    box.python("python3.12", "3.12.1")
    (box.home / "slow").write_text("1\n")
    first = box.start("first")
    box.wait_for_pip()
    second = box.start("second")
    results = [process.communicate(timeout=60) for process in (first, second)]
    assert [process.returncode for process in (first, second)] == [0, 0], results
    assert "ran <first>" in results[0][0] and "ran <second>" in results[1][0]
    assert "waiting" in results[1][1]
    assert len(box.pip_calls()) == 1


def test_with_ros_sourced_its_python_and_numpy_are_kept(box, tmp_path):
    box.python("python3.12", "3.12.3")
    box.python("python3", "3.12.3")
    (tmp_path / "ros" / "rclpy").mkdir(parents=True)
    (tmp_path / "ros" / "rclpy" / "__init__.py").touch()
    ros = {"PYTHONPATH": str(tmp_path / "ros"), "ROS_DISTRO": "jazzy", "FAKE_RCLPY": "0"}
    assert "making .venv-ros-jazzy" in box.run("x", **ros).stderr
    assert not box.venv.exists()
    assert "[all,dev]" in box.pip_calls()[0]  # and so without cyclonedds
    assert " -c " in box.pip_calls()[0]
    assert box.run("x", **ros).stderr == ""
    assert "making .venv with" in box.run("x").stderr  # without ROS, beside it


def test_ros_that_python_cannot_import_says_so(box, tmp_path):
    box.python("python3", "3.12.3")
    (tmp_path / "ros" / "rclpy").mkdir(parents=True)
    (tmp_path / "ros" / "rclpy" / "__init__.py").write_text("raise ImportError('built for 3.99')")
    error = box.run("x", code=1, PYTHONPATH=str(tmp_path / "ros"), ROS_DISTRO="jazzy").stderr
    assert "no Python here can import its rclpy" in error
