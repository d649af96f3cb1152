# SPDX-License-Identifier: Apache-2.0
"""What is installed, by colcon (ament_python) and by pip alike.

This file is the one place of dependency ranges; `./ccr` installs from it too.
"""

import os
from glob import glob
from pathlib import Path

from setuptools import find_packages, setup

PACKAGE = "ccr_ros"
SHARE = f"share/{PACKAGE}"

# With colcon's --symlink-install this runs in a folder that holds a link to this file and links
# to what is installed, and nothing else.
HERE = Path(__file__).resolve().parent

CYCLONE_WHEELS = (
    "python_version < '3.14' and platform_python_implementation == 'CPython' and "
    "(sys_platform == 'darwin' or platform_machine == 'x86_64' or platform_machine == 'AMD64')"
)

# What not every user needs: one extra each.
FEATURES = {
    "plot": ["matplotlib>=3.8,<4"],
    "record": ["mcap>=1.2,<2"],
    "design": ["scipy>=1.11,<2"],
    "quality": ["scipy>=1.11,<2"],
    "print": ["manifold3d>=3.1,<4", "trimesh>=4.5,<6"],
    "mesh": ["scipy>=1.11,<2", "trimesh>=4.5,<6"],
    "dynamixel": ["dynamixel-sdk>=3.8.4,<5"],
    "bench": ["scipy>=1.11,<2"],
}


def tree(folder: str, *patterns: str) -> list[tuple[str, list[str]]]:
    """List the files below `folder` that match, as data_files entries under share/ccr_ros."""
    found: dict[str, list[str]] = {}
    for pattern in patterns:
        for path in sorted(glob(f"{folder}/**/{pattern}", recursive=True)):
            found.setdefault(f"{SHARE}/{os.path.dirname(path)}", []).append(path)
    return sorted(found.items())


setup(
    name=PACKAGE,
    version="0.1.0",
    description="Grippers with cable-driven continuum fingers: model, solver and ROS 2 nodes",
    long_description=(HERE / "README.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    author="ccr_ros maintainers",
    author_email="maintainers@ccr-ros.example",
    maintainer="ccr_ros maintainers",
    maintainer_email="maintainers@ccr-ros.example",
    license="Apache-2.0",
    python_requires=">=3.11",
    packages=find_packages(include=["ccr_ros", "ccr_ros.*", "embedded_ros", "embedded_ros.*"]),
    package_data={"": ["py.typed"], "ccr_ros.viz": ["templates/*"]},
    zip_safe=False,
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (SHARE, ["package.xml"]),
        *tree("config", "*.yaml", "*.csv"),
        *tree("msg_defs", "package.xml", "*.msg", "*.srv", "*.action"),
        *tree("launch", "*.launch.py", "*.launch.xml", "*.launch.yaml"),
        *tree("rviz", "*.rviz"),
    ],
    install_requires=[
        "numpy>=1.26,<3",
        "casadi>=3.7,<4",
        "PyYAML>=6.0,<7",
        "transitions>=0.9,<0.10",  # the state machine of grasp/
    ],
    extras_require={
        # The rclpy of machines without ROS 2 (see embedded_ros); never needed under ROS 2.
        # cyclonedds: each minor release may change the binding that embedded_ros relies on. Asked
        # for where there are wheels (11.0.1); elsewhere embedded_ros has a transport of its own.
        "embedded": [f"cyclonedds>=11.0.1,<11.1; {CYCLONE_WHEELS}", "rosbags>=0.11,<0.12"],
        **FEATURES,
        # All of these features, as ./ccr has them.
        "all": [requirement for feature in FEATURES.values() for requirement in feature],
        "dev": [
            "pytest>=8,<10",
            "pytest-xdist>=3.7,<4",
            "pytest-timeout>=2.2,<3",
            "hypothesis>=6.98,<7",
            "mcap-ros2-support>=0.5,<1",
            "ruff>=0.15,<0.18",
            "mypy>=1.15,<3",
            "types-PyYAML>=6.0",
            "setuptools>=68.1",
            "wheel>=0.42",
        ],
    },
    entry_points={
        "console_scripts": [
            "ccr = ccr_ros.cli.main:main",
            "gripper_coordinator_node = ccr_ros.nodes.entry:gripper_coordinator_node",
            "servo_bridge_node = ccr_ros.nodes.entry:servo_bridge_node",
            "solver_node = ccr_ros.nodes.entry:solver_node",
        ],
    },
)
