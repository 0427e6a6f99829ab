"""The units a case file may write, with factors to mm, N, MPa, t/mm^3, K, s, bytes, degrees."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

_INCH = 25.4  # mm, exact
_POUND = 0.45359237e-3  # t, exact
_GRAVITY = 9806.65  # mm/s^2, standard gravity, exact
_POUND_FORCE = _POUND * _GRAVITY  # N


@dataclass(frozen=True, slots=True, kw_only=True)
class Dimension:
    """A kind of quantity."""

    phrase: str  #: With its article, for messages: "a force".
    example: str  #: A value that parses.
    units: Mapping[str, float]  #: Spelling to the factor that converts to the internal unit.
    #: Magnitudes, in the internal unit, between which a value other than zero can be meant.
    least: float
    most: float

    @property
    def unit(self) -> str:
        """The unit that messages show: the first one."""
        return next(iter(self.units))

    def words(self, value: float) -> str:
        """A value of the internal unit in the unit that messages show, or a smaller one."""
        unit = self._unit_of(value)
        return f"{value / self.units[unit]:g} {unit}".rstrip()

    @property
    def span(self) -> str:
        """The magnitudes that can be meant, both in one unit."""
        unit = self._unit_of(self.most)
        ends = (f"{end / self.units[unit]:g} {unit}".rstrip() for end in (self.least, self.most))
        return " and ".join(ends)

    def _unit_of(self, value: float) -> str:
        """The first unit, or a smaller one for a value of less than a tenth of it."""
        unit = self.unit
        if 0.0 < abs(value) < 0.1 * self.units[unit]:
            unit = next((u for u, factor in self.units.items() if abs(value) >= factor), unit)
        return unit


def _dimension(
    phrase: str, example: str, span: tuple[float, float], **groups: Mapping[str, float]
) -> Dimension:
    merged = {unit: factor for group in groups.values() for unit, factor in group.items()}
    return Dimension(
        phrase=phrase,
        example=example,
        units=MappingProxyType(merged),
        least=span[0],
        most=span[1],
    )


_LENGTH = {
    "mm": 1.0,
    "um": 1e-3,
    "micron": 1e-3,
    "cm": 10.0,
    "m": 1000.0,
    "inch": _INCH,
    "in": _INCH,
    "ft": 12 * _INCH,
}
_FORCE = {
    "N": 1.0,
    "mN": 1e-3,
    "kN": 1e3,
    "MN": 1e6,
    "lbf": _POUND_FORCE,
    "kgf": _GRAVITY * 1e-3,
}
_PRESSURE = {
    "MPa": 1.0,
    "Pa": 1e-6,
    "kPa": 1e-3,
    "GPa": 1e3,
    "N/mm^2": 1.0,
    "kN/mm^2": 1e3,
    "N/m^2": 1e-6,
    "kN/m^2": 1e-3,
    "bar": 0.1,
    "psi": _POUND_FORCE / _INCH**2,
    "ksi": 1e3 * _POUND_FORCE / _INCH**2,
    "Msi": 1e6 * _POUND_FORCE / _INCH**2,
}
_DENSITY = {
    "g/cm^3": 1e-9,
    "kg/m^3": 1e-12,
    "t/mm^3": 1.0,
    "t/m^3": 1e-9,
    "kg/dm^3": 1e-9,
    "kg/mm^3": 1e-3,
    "g/mm^3": 1e-6,
    "lb/in^3": _POUND / _INCH**3,
}
#: Factors to 1/K; a degree Celsius and a kelvin are the same difference.
_EXPANSION = {
    "1/K": 1.0,
    "um/m/K": 1e-6,
    "um/(m*K)": 1e-6,
    "mm/m/K": 1e-3,
    "mm/mm/K": 1.0,
    "ppm/K": 1e-6,
    "1/degC": 1.0,
    "um/m/degC": 1e-6,
}
_MOMENT = {
    "N*m": 1e3,
    "N*mm": 1.0,
    "kN*m": 1e6,
    "kN*mm": 1e3,
    "Nm": 1e3,
    "Nmm": 1.0,
    "kNm": 1e6,
    "lbf*in": _POUND_FORCE * _INCH,
    "lbf*ft": _POUND_FORCE * 12 * _INCH,
}
_WORK = {"N*mm": 1.0, "mJ": 1.0, "J": 1e3, "kJ": 1e6, **_MOMENT}
_MASS = {"kg": 1e-3, "t": 1.0, "lb": _POUND}
#: Bytes: decimal prefixes as SI has them, binary ones as IEC 80000-13.
_MEMORY = {
    "GB": 1e9,
    "B": 1.0,
    "kB": 1e3,
    "MB": 1e6,
    "TB": 1e12,
    "KiB": 2.0**10,
    "MiB": 2.0**20,
    "GiB": 2.0**30,
    "TiB": 2.0**40,
}

#: Name of a dimension to its record. The first unit listed is the one messages show. The spans are
#: wide: from atoms to bridges, so that only a slip of the keyboard or of the unit falls outside.
DIMENSIONS: Mapping[str, Dimension] = MappingProxyType(
    {
        "length": _dimension("a length", "12 mm", (1e-9, 1e6), a=_LENGTH),
        "area": _dimension(
            "an area",
            "600 mm^2",
            (1e-12, 1e12),
            a={"mm^2": 1.0, "cm^2": 100.0, "m^2": 1e6, "in^2": _INCH**2, "inch^2": _INCH**2},
        ),
        "volume": _dimension(
            "a volume",
            "12 mm^3",
            (1e-15, 1e15),
            a={"mm^3": 1.0, "cm^3": 1e3, "m^3": 1e9, "in^3": _INCH**3, "inch^3": _INCH**3},
        ),
        "force": _dimension("a force", "5 kN", (1e-12, 1e12), a=_FORCE),
        "pressure": _dimension("a pressure or stress", "50 MPa", (1e-12, 1e9), a=_PRESSURE),
        "stress": _dimension("a pressure or stress", "50 MPa", (1e-12, 1e9), a=_PRESSURE),
        "density": _dimension("a mass density", "4.43 g/cm^3", (1e-15, 1e-3), a=_DENSITY),
        "acceleration": _dimension(
            "an acceleration",
            "9.81 m/s^2",
            (1e-9, 1e12),
            a={"m/s^2": 1e3, "mm/s^2": 1.0, "g": _GRAVITY},
        ),
        "temperature": _dimension(
            "a temperature change", "60 K", (1e-9, 1e4), a={"K": 1.0, "degC": 1.0}
        ),
        "thermal_expansion": _dimension(
            "a thermal expansion", "8.6e-6 1/K", (1e-12, 1e-2), a=_EXPANSION
        ),
        "time": _dimension(
            "a time",
            "20 min",
            (1e-6, 1e9),
            a={"min": 60.0, "s": 1.0, "ms": 1e-3, "h": 3600.0},
        ),
        "frequency": _dimension(
            "a frequency",
            "400 Hz",
            (1e-6, 1e9),
            a={"Hz": 1.0, "kHz": 1e3, "rpm": 1.0 / 60.0},
        ),
        "memory": _dimension("an amount of memory", "8 GB", (1.0, 1e15), a=_MEMORY),
        "angle": _dimension(
            "an angle", "15 deg", (1e-12, 360.0), a={"deg": 1.0, "rad": 180.0 / math.pi}
        ),
        # No key of a case takes one: weights are told from forces by it.
        "mass": _dimension("a mass", "2 kg", (1e-15, 1e9), a=_MASS),
        "moment": _dimension("a moment", "20 N*m", (1e-12, 1e15), a=_MOMENT),
        "work": _dimension("a work", "120 N*mm", (1e-15, 1e15), a=_WORK),
        "number": _dimension("a plain number", "0.3", (1e-12, 1e12), a={"": 1.0, "%": 0.01}),
    }
)

#: Units by other names, with the spelling of the tables.
SPOKEN_UNITS: Mapping[str, str] = MappingProxyType(
    {
        spoken: unit
        for unit, names in {
            "mm": "millimeter millimeters millimetre millimetres",
            "um": "micrometer micrometers micrometre micrometres microns",
            "cm": "centimeter centimeters centimetre centimetres",
            "m": "meter meters metre metres",
            "inch": "inches",
            "ft": "foot feet",
            "N": "newton newtons",
            "kN": "kilonewton kilonewtons",
            "lb": "lbs pound pounds",
            "kg": "kilogram kilograms kgs",
            "MPa": "megapascal megapascals",
            "min": "mins minute minutes",
            "s": "sec secs second seconds",
            "h": "hr hrs hour hours",
            "Hz": "hertz",
            "kHz": "kilohertz",
            "degC": "c celsius",
            "K": "kelvin",
            "deg": "degree degrees",
            "rad": "radian radians",
        }.items()
        for spoken in names.split()
    }
)
