# SPDX-License-Identifier: Apache-2.0
"""A finger file as text and as the dictionary in it, changes of it, and how they are refused."""

import copy

import pytest
import yaml

from ccr_ros.model import InvalidValue, finger_from_dict

TEXT = """\
name: small
length: 0.1
segments: 2
disk_radius: 0.008
backbone_diameter: 0.0025
poisson_ratio: 0.39
cables:
  - {name: main, holes: [1, 2, 12]}
"""
DATA = yaml.safe_load(TEXT)


def changed(**keys):
    return {**copy.deepcopy(DATA), **keys}


def refused(data):
    with pytest.raises(InvalidValue) as caught:
        finger_from_dict(data, source="x.yaml")
    error = caught.value
    assert error.source == "x.yaml"
    assert "\n" not in str(error)
    assert str(error).startswith(f"x.yaml: {error.place}: " if error.place else "x.yaml: ")
    return error
