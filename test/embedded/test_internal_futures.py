# SPDX-License-Identifier: Apache-2.0
"""What a future leaves behind when it goes."""

import gc

import pytest
from rclpy.task import Future, Task


def test_an_exception_that_nobody_asked_for_is_told(capsys):
    Task(lambda: 1 / 0)()
    gc.collect()
    assert capsys.readouterr().err == (
        "The following exception was never retrieved: division by zero\n"
    )


@pytest.mark.parametrize("ask", [Future.exception, Future.result])
def test_one_that_was_asked_for_is_not(capsys, ask):
    future = Future()
    future.set_exception(ValueError("known"))
    try:
        ask(future)
    except ValueError as error:
        assert str(error) == "known"
    del future
    gc.collect()
    assert not capsys.readouterr().err


def test_nor_is_anything_of_one_that_went_well(capsys):
    future = Future()
    future.set_result(4)
    assert future.exception() is None and future.result() == 4
    del future
    gc.collect()
    assert not capsys.readouterr().err


def test_an_interrupt_cannot_be_lost_in_the_end_of_a_future():
    """Python would swallow the KeyboardInterrupt of a signal that comes within a ``__del__``."""
    assert not hasattr(Future, "__del__") and not hasattr(Task, "__del__")
