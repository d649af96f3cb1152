# SPDX-License-Identifier: Apache-2.0
"""The replay: one file, complete, that loads nothing and that no name can break."""

import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest
import synthetic

from ccr_ros.model import InvalidFile
from ccr_ros.viz.recording_json import recording_from_json, recording_to_json
from ccr_ros.viz.replay import replay_html, write_replay


class Page(HTMLParser):
    """The elements of a page, and the text of its scripts, as a browser would find them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[str, str] = {}
        self._open = ""
        self.feed(text)

    def handle_starttag(self, tag, attrs) -> None:
        self.elements.append((tag, dict(attrs)))
        self._open = dict(attrs).get("id") or tag

    def handle_data(self, data) -> None:
        self.texts[self._open] = self.texts.get(self._open, "") + data

    def handle_endtag(self, tag) -> None:
        self._open = ""


@pytest.fixture(scope="module")
def recording():
    return synthetic.recording(duration=1.0, rate=10.0)


def test_nothing_refers_to_anything_outside_the_file(recording, tmp_path) -> None:
    text = write_replay(recording, tmp_path / "replay.html").read_text(encoding="utf-8")
    assert "@@" not in text
    assert not re.search(
        r"https?:|//[a-z]|@import|url\(|fetch\(|XMLHttpRequest|WebSocket|import\(", text
    )
    page = Page(text)
    for tag, attributes in page.elements:
        assert "src" not in attributes, tag
        if "href" in attributes:
            assert attributes["href"] == "data:,"
    policy = next(
        a["content"] for _, a in page.elements if a.get("http-equiv") == "Content-Security-Policy"
    )
    assert policy.startswith("default-src 'none'")


def test_the_recording_is_in_it_unchanged(recording) -> None:
    page = Page(replay_html(recording))
    embedded = page.texts["recording"]
    assert json.loads(embedded) == json.loads(recording_to_json(recording))
    assert len(recording_from_json(embedded).frames) == 11
    assert page.texts["title"] == "sphere gripper - replay"


@pytest.mark.parametrize(
    "name",
    [
        "</script><script>alert(1)</script>",
        "<!-- <script>",
        "@@JS@@ @@RECORDING@@",
        'quote " and \\ and & and \u2028 and \u00e9 \u6307',
    ],
)
def test_names_cannot_break_the_page(recording, name) -> None:
    plain, odd = Page(replay_html(recording)), Page(replay_html(replace(recording, gripper=name)))
    assert json.loads(odd.texts["recording"])["gripper"] == name
    assert [e[0] for e in odd.elements] == [e[0] for e in plain.elements]
    assert odd.texts["script"] == plain.texts["script"]


def test_every_control_is_there_and_has_a_name_for_screen_readers(recording) -> None:
    text = replay_html(recording)
    page = Page(text)
    ids = {a["id"] for _, a in page.elements if a.get("id")}
    used = set(re.findall(r'(?<!\.)(?:\$|\bget)\("([a-z][a-z-]*)"\)', page.texts["script"]))
    assert used and used <= ids
    labelled = {a.get("id") for _, a in page.elements if a.get("aria-label")}
    assert {"view", "scrub", "play", "back", "next", "theme", "bands"} <= labelled


def test_a_path_that_cannot_be_written_is_told(recording, tmp_path) -> None:
    with pytest.raises(InvalidFile, match="cannot be written"):
        write_replay(recording, tmp_path / "no" / "replay.html")
