# SPDX-License-Identifier: Apache-2.0
"""Like fingers at once are what each of them is by itself."""

from dataclasses import fields, replace

import numpy as np
import pytest

from ccr_ros.model import Cable, Finger, SolverSettings
from ccr_ros.model.kinematics import Kinematics

SEGMENTS = 5


def finger(holes=(0.0,), turn=0.0, **values):
    cables = [
        Cable(f"c{i}", angle + turn * np.arange(SEGMENTS + 1)) for i, angle in enumerate(holes)
    ]
    options = {
        "length": 0.1,
        "segments": SEGMENTS,
        "disk_radius": 0.008,
        "backbone_diameter": 0.002,
        "poisson_ratio": 0.4,
        "cables": cables,
    }
    return Finger(name="f", **{**options, **values})


def alike():
    """Fingers of one structure: other routing, rest shape, size and torsional stiffness."""
    bent = np.tile([0.0, 6.0, 0.0], (SEGMENTS, 1))
    return [
        finger(),
        finger(turn=0.3, length=0.15, disk_radius=0.01),
        finger(holes=(1.0,), rest_curvature=bent, poisson_ratio=0.2),
    ]


def leaves(thing):
    if isinstance(thing, np.ndarray):
        return [thing]
    return [leaf for field in fields(thing) for leaf in leaves(getattr(thing, field.name))]


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("cable_model", ["frictionless", "proportional"])
def test_stacked_fingers_are_what_each_is(order, cable_model):
    settings = SolverSettings(curvature_order=order, cable_model=cable_model)
    single = [Kinematics(f, settings) for f in alike()]
    assert len({k.likeness for k in single}) == 1
    stack = Kinematics.stacked(single)
    rng = np.random.default_rng(4)
    y = rng.normal(size=(3, stack.size))
    tensions = rng.uniform(0.0, 5.0, (3, len(stack.group_cable)))
    pushes = rng.normal(size=(3, len(stack.points.labels), 3))
    at = stack.place(y)
    first = stack.linearize(at)
    hessians = stack.curvature(at, first, tensions, pushes)
    for f, one in enumerate(single):
        alone = one.place(y[f])
        for found, wanted in zip(leaves(at), leaves(alone), strict=True):
            np.testing.assert_allclose(found[f], wanted, atol=1e-13)
        slopes = one.linearize(alone)
        for found, wanted in zip(leaves(first), leaves(slopes), strict=True):
            np.testing.assert_allclose(found[f], wanted, atol=1e-13)
        wanted = one.curvature(alone, slopes, tensions[f], pushes[f])
        np.testing.assert_allclose(hessians[f], wanted, atol=1e-11)


def test_a_stack_of_one_has_a_leading_axis():
    one = Kinematics(finger(), SolverSettings())
    y = np.full(one.size, 0.3)
    np.testing.assert_array_equal(
        Kinematics.stacked([one]).place(y[None]).points[0], one.place(y).points
    )


@pytest.mark.parametrize(
    "other",
    [
        finger(segments=4, cables=[Cable("c0", np.zeros(5))]),
        finger(holes=(0.0, 2.0)),
        finger(holes=(0.0, np.pi)),  # opposite holes share their points
        finger(cables=[Cable("c0", np.zeros(4))]),
        replace(finger(), rest_curvature=np.tile([0.0, 6.0, 0.0], (SEGMENTS, 4, 1))),
    ],
    ids=["segments", "cables", "opposite cables", "shorter cable", "finer rest shape"],
)
def test_fingers_of_other_structure_are_not_alike(other):
    settings = SolverSettings()
    assert Kinematics(other, settings).likeness != Kinematics(finger(), settings).likeness


def test_cable_models_are_not_alike():
    models = ("frictionless", "proportional")
    found = {Kinematics(finger(), SolverSettings(cable_model=m)).likeness for m in models}
    assert len(found) == 2
