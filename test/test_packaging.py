# SPDX-License-Identifier: Apache-2.0
"""What is installed where, by pip and in the way colcon calls setup.py."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import venv
import zipfile
from importlib.metadata import distribution
from pathlib import Path
from xml.etree import ElementTree

import pytest

import ccr_ros

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ("ccr_ros", "config", "embedded_ros", "launch", "msg_defs", "resource", "rviz")
SOURCES += ("LICENSE", "README.md", "package.xml", "pyproject.toml", "setup.cfg", "setup.py")

# What catkin_pkg, and with it colcon, takes for an address; others make it skip the package.
EMAIL = re.compile(r"[-\w%+]+(\.[-\w%+]+)*@[-a-zA-Z0-9%]+(\.[-a-zA-Z0-9%]+)*\.[a-zA-Z]{2,}")


def check(command, **options):
    done = subprocess.run(
        [os.fspath(word) for word in command], capture_output=True, text=True, **options
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def package_xml(folder: Path) -> ElementTree.Element:
    return ElementTree.parse(folder / "package.xml").getroot()


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """A copy of the sources alone, so that building leaves nothing in the checkout."""
    copy = tmp_path_factory.mktemp("source") / "ccr"
    copy.mkdir()
    for name in SOURCES:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
        elif (ROOT / name).exists():
            shutil.copy(ROOT / name, copy)
    return copy


@pytest.fixture(scope="module")
def wheel(source, tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "wheel", "--quiet"]
    check([*pip, "--no-deps", "--no-build-isolation", "--wheel-dir", folder, source])
    (built,) = folder.glob("*.whl")
    return built


def test_versions_agree():
    assert distribution("ccr_ros").version == ccr_ros.__version__
    for folder in (ROOT, ROOT / "msg_defs"):
        assert package_xml(folder).findtext("version") == ccr_ros.__version__
    assert f"## [{ccr_ros.__version__}]" in (ROOT / "CHANGELOG.md").read_text()


def test_package_xml_is_what_colcon_accepts():
    for folder, name, build_type in (
        (ROOT, "ccr_ros", "ament_python"),
        (ROOT / "msg_defs", "ccr_msgs", "ament_cmake"),
    ):
        root = package_xml(folder)
        assert root.get("format") == "3"
        assert root.findtext("name") == name
        assert root.findtext("export/build_type") == build_type
        assert root.findtext("license") == "Apache-2.0"
        (maintainer,) = root.findall("maintainer")
        assert EMAIL.fullmatch(maintainer.get("email"))


def test_package_xml_names_every_ros_package_that_is_imported():
    imported = set()
    for path in (ROOT / "ccr_ros").rglob("*.py"):
        text = path.read_text()
        imported |= set(re.findall(r"^\s*(?:from|import) (\w+_msgs|\w+_srvs|rclpy)\b", text, re.M))
    depends = {node.text for node in package_xml(ROOT).findall("exec_depend")}
    assert imported <= depends


def test_every_interface_file_is_built():
    listed = re.findall(
        r'"((?:msg|srv|action)/\w+\.\w+)"', (ROOT / "msg_defs/CMakeLists.txt").read_text()
    )
    there = [
        path.relative_to(ROOT / "msg_defs").as_posix()
        for kind in ("msg", "srv", "action")
        for path in (ROOT / "msg_defs" / kind).glob(f"*.{kind}")
    ]
    assert sorted(listed) == sorted(there)


def test_entry_points_lead_to_functions():
    scripts = distribution("ccr_ros").entry_points.select(group="console_scripts")
    assert {"ccr", "solver_node", "servo_bridge_node", "gripper_coordinator_node"} <= set(
        scripts.names
    )
    for script in scripts:
        assert callable(script.load()), script


def test_dependency_ranges_are_in_setup_py_alone():
    assert "project" not in tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert "install_requires" not in (ROOT / "setup.cfg").read_text()
    assert not list(ROOT.glob("*requirements*"))


def test_the_node_dependencies_of_embedded_ros_stay_optional():
    # Under ROS 2, rosdep installs what package.xml names, which cyclonedds is not among.
    requires = distribution("ccr_ros").requires or []
    needed = [line for line in requires if "extra" not in line]
    assert {re.match(r"\w+", line).group().lower() for line in needed} == {
        "casadi",
        "numpy",
        "pyyaml",
        "transitions",
    }


@pytest.mark.long
def test_wheel_holds_code_data_and_scripts(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    data = f"ccr_ros-{ccr_ros.__version__}.data/data/share"
    for name in (
        "ccr_ros/py.typed",
        "ccr_ros/cli/main.py",
        "embedded_ros/__init__.py",
        f"{data}/ament_index/resource_index/packages/ccr_ros",
        f"{data}/ccr_ros/package.xml",
        f"{data}/ccr_ros/msg_defs/package.xml",
    ):
        assert name in names
    for package in ("ccr_ros", "embedded_ros"):
        for path in (ROOT / package).rglob("*.py"):
            assert path.relative_to(ROOT).as_posix() in names
    for folder, suffix in (("config", "yaml"), ("msg_defs/msg", "msg")):
        for path in (ROOT / folder).glob(f"*.{suffix}"):
            assert f"{data}/ccr_ros/{folder}/{path.name}" in names
    assert not [name for name in names if name.startswith(("test", "benchmarks", "config"))]
    assert not [name for name in names if "/lib/" in name]  # setup.cfg is for colcon alone


@pytest.mark.long
def test_pip_install_runs_and_finds_its_files(wheel, tmp_path):
    home = tmp_path / "an environment"
    venv.create(home, with_pip=False)
    python = home / "bin" / "python"
    # the dependencies: this interpreter's own
    paths = sysconfig.get_paths(vars={"base": os.fspath(home), "platbase": os.fspath(home)})
    mine = [path for path in sys.path if path.endswith(("site-packages", "dist-packages"))]
    Path(paths["purelib"], "dependencies.pth").write_text("\n".join(mine))
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", python]
    check([*pip, "install", "--quiet", "--no-deps", "--ignore-installed", wheel])

    plain = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "AMENT_PREFIX_PATH")}
    version = check([home / "bin" / "ccr", "--version"], cwd=tmp_path, env=plain)
    assert version.strip() == f"ccr_ros {ccr_ros.__version__}"
    assert (home / "bin" / "solver_node").is_file()
    code = "import ccr_ros.resources as r; print(r.share_dir(), *r.config_names(), sep='\\n')"
    share, *names = check([python, "-c", code], cwd=tmp_path, env=plain).splitlines()
    assert Path(share) == home / "share" / "ccr_ros"
    assert names == sorted(path.stem for path in (ROOT / "config").glob("*.yaml"))


@pytest.mark.long
def test_pip_target_finds_its_files(wheel, tmp_path):
    target = tmp_path / "target"
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
    check([*pip, "--no-deps", "--target", target, wheel])
    code = "import ccr_ros.resources as r; print(r.msg_defs_dir())"
    found = check([sys.executable, "-c", code], cwd=tmp_path, env={"PYTHONPATH": str(target)})
    assert Path(found.strip()) == target / "share" / "ccr_ros" / "msg_defs"


@pytest.mark.long
def test_colcon_install_puts_the_nodes_where_ros2_run_looks(source, tmp_path):
    prefix = tmp_path / "install" / "ccr_ros"
    # as colcon-core calls it for ament_python
    base = ["egg_info", "--egg-base", tmp_path, "build", "--build-base", tmp_path / "build"]
    install = ["install", "--prefix", prefix, "--record", tmp_path / "install.log"]
    install += ["--single-version-externally-managed"]
    check([sys.executable, "-W", "ignore", "setup.py", *base, *install], cwd=source)
    assert os.access(prefix / "lib" / "ccr_ros" / "solver_node", os.X_OK)
    assert (prefix / "share/ament_index/resource_index/packages/ccr_ros").is_file()
    assert (prefix / "share/ccr_ros/package.xml").is_file()
    (code,) = prefix.glob("**/site-packages/ccr_ros")
    found = check(
        [sys.executable, "-c", "import ccr_ros.resources as r; print(r.share_dir())"],
        cwd=tmp_path,
        env={"PYTHONPATH": str(code.parent)},
    )
    assert Path(found.strip()) == prefix / "share" / "ccr_ros"


@pytest.mark.long
def test_setup_runs_among_links_as_with_colcons_symlink_install(source, tmp_path):
    for name in ("ccr_ros", "embedded_ros", "package.xml", "setup.cfg", "setup.py"):
        (tmp_path / name).symlink_to(source / name)
    version = check([sys.executable, "-W", "ignore", "setup.py", "--version"], cwd=tmp_path)
    assert version.splitlines()[-1] == ccr_ros.__version__
