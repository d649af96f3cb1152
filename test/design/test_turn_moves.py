# SPDX-License-Identifier: Apache-2.0
"""Random changes stay smooth, keep cables apart and bases near, and come again for a seed."""

import pytest

from ccr_ros.design.turn_moves import TurnChoice, TurnMoves, apart, smooth, winding
from ccr_ros.design.turn_units import UnitChoice

THUMB = UnitChoice(((2,) * 9 + (0,), (-2,) * 10), 0.0, 0.001)
PAIR = UnitChoice(((1, 1, 0, 0, -1, -1, -1, 0, 0, 0),), 0.0, 0.017)
GIVEN = TurnChoice((THUMB, PAIR))


def walk(seed, count):
    moves, choice, found = TurnMoves(GIVEN, [12, 12], seed), GIVEN, []
    for _ in range(count):
        choice = moves.of([choice, GIVEN])
        found.append(choice)
    return found


def test_winding_counts_holes():
    assert winding((2, 2, 2)) == 0 and winding((1, 0, -1, 0)) == 3
    assert GIVEN.winding == 2 + 0 + 3


def test_paths_change_by_one_hole_or_as_they_did():
    given = ((0, 0, 2, 2),)
    assert smooth(((1, 0, 1, 2),), given) and smooth(((0, 0, -2, -1),), given)
    assert not smooth(((0, 2, 2, 2),), given) and not smooth(((0, 0, 3, 3),), given)


def test_cables_are_apart_modulo_the_holes_of_a_disk():
    assert apart(((0, 1), (1, 2)), 12)
    assert not apart(((0, 1), (1, 1)), 12)
    assert not apart(((0, -1), (1, 11)), 12)
    assert apart(((0, 1, 5), (1, 2)), 12)  # one ends before the other


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_long_walk_stays_within_what_can_be_built(seed):
    found = walk(seed, 300)
    assert len(set(found)) > 200
    for choice in found:
        assert 0.25 <= choice.force <= 4.0
        for unit, given in zip(choice.units, GIVEN.units, strict=True):
            assert smooth(unit.holes, given.holes) and apart(unit.holes, 12)
            assert abs(unit.distance - given.distance) <= 0.03 + 1e-12
            assert abs(unit.spot - given.spot) <= 0.01 + 1e-12
    for key in ("holes", "distance", "spot"):
        assert any(getattr(c.units[1], key) != getattr(PAIR, key) for c in found)
    assert any(c.force != 1.0 for c in found)


def test_a_seed_draws_the_same_again_and_another_differs():
    assert walk(7, 40) == walk(7, 40)
    assert walk(7, 40) != walk(8, 40)
