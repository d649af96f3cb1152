# SPDX-License-Identifier: Apache-2.0
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ccr_ros import resources
from ccr_ros.model.errors import InvalidFile, UnknownName

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture
def layout(tmp_path, monkeypatch):
    """Return a function that pretends that the code lies in a folder below tmp_path."""

    def pretend(code: str, share: str) -> Path:
        package = tmp_path / code / "ccr_ros"
        package.mkdir(parents=True)
        monkeypatch.setattr(resources, "__file__", str(package / "resources.py"))
        data = tmp_path / share
        (data / "msg_defs").mkdir(parents=True)
        shutil.copy(ROOT / "package.xml", data)
        shutil.copy(ROOT / "msg_defs" / "package.xml", data / "msg_defs")
        (data / "config").mkdir()
        (data / "config" / "bent.yaml").write_text("name: bent\n")
        return data

    return pretend


def test_checkout():
    assert resources.share_dir() == ROOT
    assert (resources.msg_defs_dir() / "msg" / "CablePulls.msg").is_file()


@pytest.mark.parametrize(
    ("code", "share"),
    [
        ("venv/lib/python3.12/site-packages", "venv/share/ccr_ros"),
        ("usr/local/lib/python3.12/dist-packages", "usr/local/share/ccr_ros"),
        ("local/lib/python3.12/dist-packages", "local/share/ccr_ros"),
        ("target", "target/share/ccr_ros"),
        ("install/ccr_ros/lib/python3.12/site-packages", "install/ccr_ros/share/ccr_ros"),
        ("install/lib/python3.12/site-packages", "install/share/ccr_ros"),
    ],
)
def test_installed_layouts(layout, code, share):
    data = layout(code, share)
    assert resources.share_dir() == data
    assert resources.find_config("bent") == data / "config" / "bent.yaml"
    assert resources.config_names() == ["bent"]


def test_linked_code_finds_the_files_beside_what_it_leads_to(layout, tmp_path, monkeypatch):
    # colcon build --symlink-install: build/ccr_ros/ccr_ros -> src/ccr/ccr_ros
    data = layout("src/ccr", "src/ccr")
    (tmp_path / "build").mkdir()
    (tmp_path / "build" / "ccr_ros").symlink_to(tmp_path / "src" / "ccr" / "ccr_ros")
    monkeypatch.setattr(resources, "__file__", str(tmp_path / "build/ccr_ros/resources.py"))
    assert resources.share_dir() == data


def test_sourced_workspace_is_the_last_resort(layout, tmp_path, monkeypatch):
    data = layout("elsewhere", "install/ccr_ros/share/ccr_ros")
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"/nowhere:{tmp_path / 'install' / 'ccr_ros'}")
    assert resources.share_dir() == data


def test_code_without_its_data_files_says_so(layout, tmp_path, monkeypatch):
    shutil.rmtree(layout("lonely", "share/ccr_ros"))
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    with pytest.raises(InvalidFile, match="data files"):
        resources.share_dir()


def test_a_file_is_found_by_path_name_and_file_name(layout, tmp_path, monkeypatch):
    data = layout("src", "src")
    bent = data / "config" / "bent.yaml"
    assert resources.find_config("bent") == bent
    assert resources.find_config("bent.yaml") == bent
    assert resources.find_config(bent) == bent
    assert resources.find_config(str(bent)) == bent

    monkeypatch.chdir(tmp_path)
    Path("bent.yaml").write_text("name: mine\n")
    assert resources.find_config("bent.yaml") == Path("bent.yaml")  # the path wins
    assert resources.find_config("bent") == bent


def test_unknown_names_list_those_there_are(layout):
    layout("src", "src")
    with pytest.raises(UnknownName, match=r"'bend'.*bent") as caught:
        resources.find_config("bend")
    assert caught.value.valid == ("bent",)


@pytest.mark.parametrize("path", ["no/such.yaml", "/no/such/file", "../helical.yaml"])
def test_missing_paths_are_not_taken_for_names(layout, tmp_path, monkeypatch, path):
    layout("src", "src")
    here = tmp_path / "empty" / "folder"  # whatever lies around where the tests are run
    here.mkdir(parents=True)
    monkeypatch.chdir(here)
    with pytest.raises(InvalidFile, match="no such file"):
        resources.find_config(path)


def test_a_folder_is_not_a_config_file(layout, tmp_path):
    layout("src", "src")
    with pytest.raises(InvalidFile, match="folder"):
        resources.find_config(tmp_path)


def test_physics_loads_without_ros():
    code = "import sys, ccr_ros.resources, ccr_ros.model; print('rclpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.stdout.strip() == "False", done.stderr
