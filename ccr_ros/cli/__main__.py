# SPDX-License-Identifier: Apache-2.0
"""Lets ``python -m ccr_ros.cli`` do what ``ccr`` does."""

import sys

from ccr_ros.cli.main import main

sys.exit(main())
