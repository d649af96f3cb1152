# SPDX-License-Identifier: Apache-2.0
import os
import subprocess
import sys
from pathlib import Path

import pytest

from ccr_ros import runtime

ROOT = Path(__file__).resolve().parents[1]


def python(code, **env):
    plain = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "AMENT_PREFIX_PATH")}
    command = [sys.executable, "-c", code]
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, env=plain | env)


@pytest.fixture
def pretended_ros(tmp_path):
    """A folder for PYTHONPATH with an rclpy in it that is not ours."""
    (tmp_path / "rclpy").mkdir()
    (tmp_path / "rclpy" / "__init__.py").write_text("mark = 'real'\n")
    return tmp_path


def test_messages_of_ccr_msgs_are_importable():
    from ccr_msgs.msg import CablePulls, Contact, FingerState

    pulls = CablePulls(names=["main"], pulls=[0.005])
    assert list(pulls.pulls) == [0.005]
    assert (Contact.BACKBONE, Contact.CABLE, Contact.ANTAGONIST) == (
        "backbone",
        "cable",
        "antagonist",
    )
    assert FingerState().certificate.converged is False


def test_enabling_again_does_no_harm():
    before = list(sys.meta_path)
    assert runtime.enable_ros() is not runtime.real_ros()
    assert sys.meta_path == before


def test_real_ros_is_left_alone(pretended_ros):
    (pretended_ros / "ccr_msgs").mkdir()
    (pretended_ros / "ccr_msgs" / "__init__.py").touch()
    code = (
        "import sys; from ccr_ros.runtime import enable_ros\n"
        "print(enable_ros()); import rclpy; print(rclpy.mark, 'embedded_ros' in sys.modules)"
    )
    done = python(code, PYTHONPATH=str(pretended_ros))
    assert done.stdout.split() == ["False", "real", "False"], done.stderr


def test_real_ros_without_ccr_msgs_says_how_to_build_it(pretended_ros):
    code = (
        "from ccr_ros.runtime import RuntimeMissing, enable_ros\n"
        "try: enable_ros()\n"
        "except RuntimeMissing as error: print(error)"
    )
    done = python(code, PYTHONPATH=str(pretended_ros))
    assert runtime.BUILD_LINE in done.stdout, done.stderr


def test_a_missing_transport_says_what_to_install(monkeypatch):
    import embedded_ros

    def enable(**_):
        raise embedded_ros.MissingDependencyError("run: pip install cyclonedds")

    monkeypatch.setattr(runtime, "real_ros", lambda: False)
    monkeypatch.setattr(embedded_ros, "enable", enable)
    with pytest.raises(runtime.RuntimeMissing, match="pip install cyclonedds"):
        runtime.enable_ros()
