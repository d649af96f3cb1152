# SPDX-License-Identifier: Apache-2.0
"""Wanted curves, and objects, as people write them: ``arc:90``, ``sphere:0.112,x=0.042,z=0.110``.

Lengths in metres, angles in degrees, as everywhere at the command line.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ..model import checks
from ..model.errors import InvalidValue, UnknownName
from ..model.finger import Finger
from .contours import contour
from .curve_files import load_curve
from .curves import Curve, arc, helix, s_curve
from .section import Section

#: What each family's text looks like, for help and for errors. Options of contours: clearance
#: (beyond the disks' radius, default 0), corner (radius of the object's corners, default 1 mm or
#: 5 % of its shortest side), join (where the lead-in ends; see `contours.contour`).
FAMILIES = {
    "arc": "arc:ANGLE[,direction=ANGLE]",
    "s": "s:ANGLE[,direction=ANGLE]",
    "helix": "helix:RADIUS,turns=NUMBER[,direction=ANGLE]",
    "sphere": "sphere:DIAMETER,x=LENGTH,z=LENGTH[,OPTION=LENGTH...]",
    "cylinder": "cylinder:DIAMETERxHEIGHT,x=LENGTH,z=LENGTH[,OPTION=LENGTH...]",
    "box": "box:LENGTHxWIDTHxHEIGHT,x=LENGTH,z=LENGTH[,OPTION=LENGTH...]",
}
_SIZES = {"arc": 1, "s": 1, "helix": 1, "sphere": 1, "cylinder": 2, "box": 3}
_NEEDS = {"helix": {"turns"}, "sphere": {"x", "z"}, "cylinder": {"x", "z"}, "box": {"x", "z"}}
_MAY = {name: {"direction"} for name in ("arc", "s", "helix")} | {
    "sphere": {"clearance", "join"},
    "cylinder": {"clearance", "join", "corner"},
    "box": {"clearance", "join", "corner"},
}


@dataclass(frozen=True)
class SizedObject:
    """An object to grip, upright: its kind and its size.

    Attributes:
        kind: ``"sphere"``, ``"cylinder"`` or ``"box"``.
        size: Of a sphere the diameter; of a cylinder diameter and height; of a box its lengths
            along x, y and z [m].
        corner: Radius of its edges [m]; ``None``: 5 % of the shortest side, at most 1 mm, as of
            `Box`.
    """

    kind: str
    size: tuple[float, ...]
    corner: float | None = None

    @property
    def extent(self) -> tuple[float, float, float]:
        """Lengths along x, y and z [m]."""
        x, *rest = self.size
        if self.kind == "box":
            return x, rest[0], rest[1]
        return x, x, rest[0] if rest else x

    @property
    def corner_radius(self) -> float:
        """Radius of its edges [m]."""
        return min(0.05 * min(self.size), 0.001) if self.corner is None else self.corner

    def section(self, forward: float, up: float, across: bool = False) -> Section:
        """Return its section in a plane through its vertical axis.

        Args:
            forward: How far its centre is in front of the base [m].
            up: How far above [m].
            across: The plane is that of y and z of the object, not of x and z.
        """
        x, y, z = self.extent
        if self.kind == "sphere":
            return Section.circle(x / 2, forward, up)
        return Section((y if across else x) / 2, z / 2, self.corner_radius, forward, up)


def curve_from_text(text: str, finger: Finger, unit: str = "m") -> Curve:
    """Return the curve that a text names, as long as the finger if it is of a family.

    Args:
        text: One of `FAMILIES`, or the path of a CSV file of points (see `load_curve`).
        finger: Whose length the families take, and whose disk radius the contours keep off.
        unit: Of the numbers in the file.

    Raises:
        InvalidValue: The text is none of these, or a value is out of its range.
        InvalidFile: As `load_curve`.
    """
    family = text.partition(":")[0]
    if family not in FAMILIES:
        if Path(text).suffix.lower() == ".csv" or Path(text).is_file():
            return load_curve(text, unit)
        raise UnknownName("curve", text, ("a file.csv", *FAMILIES.values()))
    size, options = _parsed(text, family)
    length = finger.length
    direction = math.radians(options.get("direction", 0.0))
    makers: dict[str, Callable[[], Curve]] = {
        "arc": lambda: arc(length, math.radians(size[0]), direction),
        "s": lambda: s_curve(length, math.radians(size[0]), direction),
        "helix": lambda: helix(length, size[0], options["turns"], direction),
    }
    largest = {"arc": 360.0, "s": 180.0}.get(family)
    try:
        if largest:
            checks.real("angle", size[0], low=-largest, high=largest, unit="deg")
        if family in makers:
            return makers[family]()
        body = SizedObject(family, size, options.get("corner"))
        section = body.section(options["x"], options["z"])
        clearance = finger.disk_radius + options.get("clearance", 0.0)
        return contour(text, length, section, clearance, options.get("join"))
    except InvalidValue as error:
        raise error.located(text) from None


def object_from_text(text: str) -> SizedObject:
    """Return the object that a text names: sphere:DIAMETER, cylinder:DIAMETERxHEIGHT, box:LxWxH.

    Raises:
        InvalidValue: It is none of these, or a length is not positive.
    """
    forms = {k: FAMILIES[k].partition(",")[0] for k in ("sphere", "cylinder", "box")}
    family, colon, words = text.partition(":")
    if family not in forms or not colon:
        raise UnknownName("object", text, forms.values())
    return SizedObject(family, _sizes(text, family, words, forms[family]))


def _parsed(text: str, family: str) -> tuple[tuple[float, ...], dict[str, float]]:
    """Split FAMILY:SIZE,key=value,... into its numbers."""
    form = FAMILIES[family]
    first, *rest = text.partition(":")[2].split(",")
    options: dict[str, float] = {}
    needs, may = _NEEDS.get(family, set()), _MAY[family]
    for word in rest:
        key, equals, value = word.partition("=")
        if not equals or key not in needs | may or key in options:
            raise InvalidValue(text, word, form)
        options[key] = _number(text, value, form)
    missing = sorted(needs - set(options))
    if missing:
        raise InvalidValue(text, f"no {missing[0]}", form)
    return _sizes(text, family, first, form), options


def _sizes(text: str, family: str, words: str, form: str) -> tuple[float, ...]:
    parts = words.split("x") if _SIZES[family] > 1 else [words]
    sizes = tuple(_number(text, word, form) for word in parts)
    lengths = family not in ("arc", "s")
    if len(sizes) != _SIZES[family] or (lengths and not all(0 < v <= 1e3 for v in sizes)):
        more = ", lengths > 0 and <= 1000 m" if lengths else ""
        raise InvalidValue(text, words, form + more)
    return sizes


def _number(text: str, word: str, form: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InvalidValue(text, word, f"a finite number, as in {form}")
    return value
