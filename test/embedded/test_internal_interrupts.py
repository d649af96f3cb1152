# SPDX-License-Identifier: Apache-2.0
"""Exceptions of signal handlers and the DDS binding."""

import pytest

from embedded_ros.interrupts import deliver, uninterrupted


class Stop(Exception):
    pass


def stop():
    raise Stop


def test_outside_a_call_an_interrupt_comes_at_once():
    with pytest.raises(Stop):
        deliver(stop)


def test_within_a_call_it_waits_for_its_end():
    done = []
    with pytest.raises(Stop):
        with uninterrupted():
            with uninterrupted():
                deliver(stop)
            done.append("inner")
        done.append("not reached")
    assert done == ["inner"]


def test_interrupts_while_samples_are_taken_do_not_crash(program):
    """The binding runs Python from C there and would not survive an exception in it."""
    code, out, err = program("interrupted.py").finish()
    assert code == 0, err
    assert int(out.split("met:")[1]) > 50
