# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
import pytest

from ccr_ros.grasp.quality import FrictionContact, friction_margin
from ccr_ros.model import InvalidValue

X, Z = np.array([1.0, 0, 0]), np.array([0, 0, 1.0])


def contact(**given):
    return FrictionContact(**{"position": X, "normal": X, "friction": 0.5, **given})


@pytest.mark.parametrize(
    ("friction_force", "margin"), [(0.0, 1.0), (0.5, 0.5), (1.0, 0.0), (1.5, -0.5)]
)
def test_the_margin_is_the_share_of_friction_that_is_left(friction_force, margin):
    assert contact(force=2.0, friction_force=friction_force * Z).margin == pytest.approx(margin)


def test_without_friction_or_normal_force_there_is_no_margin():
    assert math.isnan(contact(friction=0.0, force=1.0).margin)
    assert math.isnan(contact().margin)
    assert math.isnan(friction_margin([contact(), contact(friction=0.0, force=1.0)]))
    assert math.isnan(friction_margin([]))


def test_the_margin_of_a_grasp_is_its_smallest():
    some = [contact(force=1.0, friction_force=f * Z) for f in (0.1, 0.4, 0.2)]
    assert friction_margin([contact(), *some]) == pytest.approx(0.2)


def test_normals_are_kept_as_unit_vectors():
    assert np.allclose(contact(normal=[3.0, 0.0, 4.0]).normal, [0.6, 0, 0.8])


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({"position": [0, 0]}, "position"),
        ({"position": [0, 0, math.nan]}, r"position\[2\]"),
        ({"normal": [0, 0, 0]}, "normal"),
        ({"normal": [math.inf, 0, 0]}, "normal"),
        ({"friction": -0.1}, "friction"),
        ({"friction": math.nan}, "friction"),
        ({"friction": "high"}, "friction"),
        ({"force": -1.0}, "force"),
        ({"force": math.inf}, "force"),
        ({"friction_force": [0, 1]}, "friction_force"),
        ({"friction_force": [0.1, 1, 0], "force": 1.0}, "tangential"),
        ({"limit": -1.0}, "limit"),
        ({"limit": math.nan}, "limit"),
        ({"limit": -math.inf}, "limit"),
    ],
)
def test_bad_values_are_named(given, named):
    with pytest.raises(InvalidValue, match=named):
        contact(**given)
