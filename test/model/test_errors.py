# SPDX-License-Identifier: Apache-2.0
import copy
import pickle

import numpy as np
import pytest

from ccr_ros.model import CcrError, InvalidFile, InvalidValue, NotConverged, UnknownName
from ccr_ros.model.errors import MissingKey, UnknownKey

ERRORS = [
    InvalidValue("cables[0].holes[3]", 13, "an integer 1..12", "f.yaml"),
    MissingKey("length", None, "given", "f.yaml"),
    UnknownKey("lenght", 1, "length, name", "f.yaml"),
    InvalidFile("f.yaml", "is empty"),
    UnknownName("cable", "left", ("main", "other")),
    NotConverged("helical", "no equilibrium"),
]


@pytest.mark.parametrize("error", ERRORS, ids=lambda e: type(e).__name__)
def test_errors_carry_their_data_through_copies_and_pickles(error):
    for twin in (copy.copy(error), pickle.loads(pickle.dumps(error))):
        assert type(twin) is type(error)
        assert str(twin) == str(error) and vars(twin) == vars(error) and vars(twin)
    assert isinstance(error, CcrError)


def test_texts():
    assert [str(error) for error in ERRORS] == [
        "f.yaml: cables[0].holes[3]: 13 is not allowed; must be an integer 1..12",
        "f.yaml: length: missing; this key is required",
        "f.yaml: lenght: unknown key (did you mean 'length'?); valid keys: length, name",
        "f.yaml: is empty",
        "unknown cable 'left'; valid: main, other",
        "finger 'helical': no converged pose: no equilibrium",
    ]


def test_fingers_and_object_together_are_no_finger():
    assert str(NotConverged("grasp", "it falls")) == "grasp: no converged pose: it falls"


def test_families():
    assert isinstance(ERRORS[0], ValueError) and isinstance(ERRORS[1], InvalidValue)
    assert isinstance(ERRORS[4], LookupError)


@pytest.mark.parametrize("kind", [InvalidValue, MissingKey, UnknownKey])
def test_locating_nests_the_place_and_keeps_the_rest(kind):
    inner = kind("holes[3]", 13, "an integer 1..12")
    assert inner.source is None
    outer = inner.located("cables[0]").located("", "f.yaml")
    assert type(outer) is kind
    assert (outer.place, outer.value, outer.allowed) == ("cables[0].holes[3]", 13, inner.allowed)
    assert outer.source == "f.yaml"
    assert outer.located("finger").source == "f.yaml"
    assert kind("", 1, "a mapping").located("cables[0]").place == "cables[0]"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (np.float64(0.5), "0.5"),
        (np.array([[1.0, 2.0], [3.0, 4.0]]), "[[1.0, 2.0], [3.0, 4.0]]"),
        ("a\nb", r"'a\nb'"),
        (10**5000, "<int>"),
        (list(range(1000)), "[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, ...]"),
    ],
    ids=["scalar", "array", "line break", "huge", "long"],
)
def test_values_are_shown_on_one_short_line(value, text):
    assert str(InvalidValue("x", value, "small")) == f"x: {text} is not allowed; must be small"
    assert str(UnknownName("cable", value, ())) == f"unknown cable {text}; valid: none"
