# SPDX-License-Identifier: Apache-2.0
"""What a design command says at its end: which files it has left."""

from __future__ import annotations

import argparse


def print_files(args: argparse.Namespace) -> None:
    """Print where ``--output`` and ``--plot`` went, if they were given, unless ``--json`` was."""
    if args.json:
        return
    for word, path in (("written to", args.output), ("drawn in", args.plot)):
        if path:
            print(f"{word} {path}")
