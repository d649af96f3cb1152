# SPDX-License-Identifier: Apache-2.0
"""Where this package's own files are: finger and gripper files, message definitions.

They are found beside the code in every layout: a checkout or an editable install (the
repository's root), a pip install in an environment, in ``--user`` or in ``--target`` (share/
of the same prefix), and colcon's install space, plain, merged or with ``--symlink-install``.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from ccr_ros.model.errors import InvalidFile, UnknownName

PACKAGE = "ccr_ros"
CONFIG_SUFFIX = ".yaml"

# From <prefix>/lib/python3.12/site-packages/ccr_ros up to <prefix>; distributions put up to
# two more folders in between.
_LEVELS_UP = 6


def share_dir() -> Path:
    """Return the folder that holds ``config/`` and ``msg_defs/``.

    Raises:
        InvalidFile: the package was installed without its data files.
    """
    for folder in _candidates():
        if (folder / "package.xml").is_file() and (folder / "msg_defs" / "package.xml").is_file():
            return folder
    raise InvalidFile(
        Path(__file__).parent,
        f"the package's data files (share/{PACKAGE}) are not installed with it; install it again",
    )


def config_dir() -> Path:
    """Return the folder of the finger and gripper files that come with the package."""
    return share_dir() / "config"


def msg_defs_dir() -> Path:
    """Return the folder of the interface package ``ccr_msgs`` (its package.xml and msg/)."""
    return share_dir() / "msg_defs"


def config_names() -> list[str]:
    """Return the names, without suffix, of all files in :func:`config_dir`, sorted."""
    return sorted(path.stem for path in config_dir().glob(f"*{CONFIG_SUFFIX}"))


def find_config(name_or_path: str | os.PathLike[str]) -> Path:
    """Return the file meant by a path, or by a bare name such as ``helical``.

    Args:
        name_or_path: An existing file; or the name, with or without ``.yaml``, of a file in
            :func:`config_dir`. A file at that path wins over a name.

    Raises:
        InvalidFile: it is written as a path, and there is no file at it.
        UnknownName: it is a bare name, and there is no such file; lists those there are.
    """
    path = Path(name_or_path).expanduser()
    if path.is_file():
        return path
    if len(path.parts) != 1:
        raise InvalidFile(path, "is a folder" if path.is_dir() else "no such file")
    name = path.name.removesuffix(CONFIG_SUFFIX)
    found = config_dir() / f"{name}{CONFIG_SUFFIX}"
    if found.is_file():
        return found
    raise UnknownName("config file", os.fspath(name_or_path), config_names())


def _candidates() -> Iterator[Path]:
    """Yield where share_dir() may be, likeliest first."""
    code = Path(__file__).parent
    # With colcon's --symlink-install the code is reached through links: look beside them first,
    # then beside the files they lead to.
    for package in (code, code.resolve()):
        yield package.parent
        for prefix in list(package.parents)[1:_LEVELS_UP]:
            yield prefix / "share" / PACKAGE
        yield package.parent / "share" / PACKAGE  # pip --target
    for sourced in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        if sourced:
            yield Path(sourced) / "share" / PACKAGE
