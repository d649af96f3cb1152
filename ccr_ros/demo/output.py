# SPDX-License-Identifier: Apache-2.0
"""The files a demo leaves."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

from ccr_ros.model import InvalidFile
from ccr_ros.viz.figures import MissingMatplotlib
from ccr_ros.viz.recording import Recording
from ccr_ros.viz.recording_json import save_recording
from ccr_ros.viz.replay import write_replay
from ccr_ros.viz.strip import write_strip

from .design import FILES

STRIP, REPLAY, RECORDING = "strip.png", "replay.html", "recording.json"


def prepare_folder(folder: Path) -> None:
    """Make the folder if need be, see that it can be written to, remove an earlier demo's files.

    Raises:
        InvalidFile: It cannot be made or written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
        for name in (STRIP, REPLAY, RECORDING, *FILES):  # of whichever demo it was
            (folder / name).unlink(missing_ok=True)
    except FileExistsError:
        raise InvalidFile(
            folder, "cannot be the demo's folder: there is a file of that name"
        ) from None
    except OSError as error:
        reason = error.strerror or str(error)
        raise InvalidFile(
            folder, f"cannot be written to ({reason}); choose another with --out"
        ) from None


def write_files(
    folder: Path, recording: Recording, say: Callable[[str], None], phases: tuple[str, ...] = ()
) -> list[Path]:
    """Write the recording, the replay and, if matplotlib is there, the strip; return their paths.

    Args:
        folder: Where to.
        recording: What was seen.
        say: Told what is left out.
        phases: Of which the strip shows the ends; see `write_strip`.

    Raises:
        InvalidFile: A file cannot be written.
    """
    paths = [
        save_recording(recording, folder / RECORDING),
        write_replay(recording, folder / REPLAY),
    ]
    try:
        paths.append(write_strip(recording, folder / STRIP, phases=phases))
    except MissingMatplotlib as error:
        say(f"no {STRIP}: {error}")
    return paths
