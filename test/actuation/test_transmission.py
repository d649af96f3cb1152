# SPDX-License-Identifier: Apache-2.0
"""Pull and angle, tension and torque: there and back, and against hand-made numbers."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from racks import joint

from ccr_ros.actuation.transmission import Transmission

transmissions = st.builds(
    lambda zero, **values: Transmission(joint(**values), zero),
    zero=st.floats(-50.0, 50.0),
    spool_radius=st.floats(1e-3, 0.1),
    direction=st.sampled_from([-1, 1]),
    gear=st.floats(0.1, 10.0),
    offset=st.floats(-0.002, 0.01),
    cable_stiffness=st.one_of(st.just(math.inf), st.floats(100.0, 1e6)),
    efficiency=st.floats(0.1, 1.0),
)


@given(transmissions, st.floats(-0.01, 0.1), st.floats(-5.0, 100.0))
def test_round_trip(transmission, pull, tension):
    angle = transmission.angle(pull, tension)
    assert transmission.pull(angle, tension) == pytest.approx(pull, abs=1e-9)
    torque = transmission.torque(tension)
    assert transmission.tension(torque) == pytest.approx(tension, rel=1e-9, abs=1e-12)


def test_by_hand():
    plain = Transmission(joint(), 0.5)
    assert plain.angle(0.01, 0.0) == pytest.approx(0.5 + 1.0)  # 10 mm on a spool of 10 mm
    assert plain.torque(20.0) == pytest.approx(0.2)
    turned = Transmission(
        joint(direction=-1, gear=3.0, offset=0.002, cable_stiffness=1e4, efficiency=0.5), 0.5
    )
    # 8 mm beyond the offset and 1 mm of stretch, three times as much at the servo, backwards
    assert turned.angle(0.01, 10.0) == pytest.approx(0.5 - 3.0 * 0.9)
    assert turned.torque(10.0) == pytest.approx(-10.0 * 0.01 / 3.0 / 0.5)


@given(transmissions, st.floats(-0.01, 0.1))
def test_winding_goes_the_servos_way(transmission, pull):
    more = transmission.angle(pull + 1e-3, 5.0) - transmission.angle(pull, 5.0)
    assert math.copysign(1, more) == transmission.joint.direction
    stretched = transmission.angle(pull, 50.0) - transmission.angle(pull, 0.0)
    assert stretched * transmission.joint.direction >= 0.0


def test_what_is_not_known_stays_so():
    unknown = Transmission(joint())
    assert math.isnan(unknown.pull(1.0, 0.0))
    # An unknown tension stretches nothing; noise around zero neither.
    stretchy = Transmission(joint(cable_stiffness=1e3), 0.0)
    for tension in (math.nan, -3.0):
        assert stretchy.pull(1.0, tension) == pytest.approx(0.01)
