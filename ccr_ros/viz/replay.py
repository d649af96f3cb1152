# SPDX-License-Identifier: Apache-2.0
"""A recording as one HTML file that plays in any browser, without a network.

The file holds the recording, a small renderer on a 2-D canvas (so that it needs no graphics card)
and nothing else; a content security policy in it forbids every request. Its address may end in
``#t=3.2&view=top&theme=dark&play``, all parts optional: the moment [s], the camera (iso, front,
side, top), the theme and whether it plays at once.
"""

from __future__ import annotations

import html
import json
from importlib import resources
from pathlib import Path

from .palette import CONTACT, FRICTION, OBJECT, PALETTE
from .recording import Recording
from .recording_json import recording_to_json, write_text

# In the order in which they need each other.
_SCRIPTS = (
    "geometry.js",
    "scene.js",
    "bodies.js",
    "charts.js",
    "readouts.js",
    "controls.js",
    "player.js",
)

_STYLE = {"palette": PALETTE, "contact": CONTACT, "friction": FRICTION, "object": OBJECT}


def write_replay(recording: Recording, path: str | Path) -> Path:
    """Write the replay of a recording as a single self-contained HTML file; return its path.

    Raises:
        InvalidFile: The file cannot be written.
    """
    return write_text(path, replay_html(recording))


def replay_html(recording: Recording) -> str:
    """Return the text of the replay's HTML file."""
    parts = {
        "@@TITLE@@": html.escape(f"{recording.gripper} - replay"),
        "@@CSS@@": _template("replay.css"),
        "@@RECORDING@@": _safe(recording_to_json(recording)),
        "@@STYLE@@": _safe(json.dumps(_STYLE)),
        "@@JS@@": "\n".join(_template(name) for name in _SCRIPTS),
    }
    # One pass over the template alone: a name in the recording that looks like a placeholder
    # stays what it is.
    text, out = _template("replay.html"), []
    for mark, part in parts.items():
        before, text = text.split(mark)
        out += [before, part]
    return "".join([*out, text])


def _safe(text: str) -> str:
    """Return JSON text that cannot end its script element nor open a comment, and is still JSON."""
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text


def _template(name: str) -> str:
    return (resources.files(__package__) / "templates" / name).read_text(encoding="utf-8")
