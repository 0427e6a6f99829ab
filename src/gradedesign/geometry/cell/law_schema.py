"""``law`` of ``[lattice]`` and ``[[zone]]``: the name of a scaling law, or a stated power law."""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

from pydantic import Field, PlainSerializer, PlainValidator

from gradedesign.common.values.suggest import shown
from gradedesign.common.values.table import Table
from gradedesign.common.values.value_types import Name, Number, Refused, Text

_EXAMPLE = "{stiffness = {c = 1.0, n = 2.0}, strength = {c = 0.3, n = 1.5}}"
#: Largest exponent: chosen, not measured; the cells that we know fit between 1 and 4.
_MOST_EXPONENT = 10.0


class PowerSpec(Table):
    """``c rho^n``: a property over that of the solid material, by relative density."""

    c: Annotated[float, Number(above=0.0)] = Field(examples=[1.0])
    """Factor."""
    n: Annotated[float, Number(above=0.0, at_most=_MOST_EXPONENT)] = Field(examples=[2.0])
    """Exponent of the relative density."""

    @property
    def pair(self) -> tuple[float, float]:
        """Factor and exponent."""
        return self.c, self.n


class StatedLaw(Table):
    """A power law after Gibson and Ashby, stated in the case."""

    stiffness: PowerSpec
    """Young's modulus over that of the solid."""
    strength: PowerSpec | None = None
    """Macroscopic stress at first yield over the yield strength of the solid; needed where the
    case limits stress."""

    @property
    def words(self) -> str:
        """The law for people to read; different laws differ in it."""
        text = f"E {self.stiffness.c:.9g} rho^{self.stiffness.n:.9g}"
        if self.strength is not None:
            text += f", strength {self.strength.c:.9g} rho^{self.strength.n:.9g}"
        return f"stated ({text})"


def _read(value: Any) -> str | StatedLaw:
    """The name of a law, or the table that states one."""
    if isinstance(value, dict):
        return StatedLaw.model_validate(value)
    if not isinstance(value, str):
        raise Refused(
            f"found {shown(value)}; expected the name of a law in quotes, or a table such as "
            f"{_EXAMPLE}"
        )
    return Text("the name of a law", 80).read(value)


def _written(law: str | StatedLaw) -> Any:
    """Serialise a law as `_read` accepts it, without pydantic's warning about the other form."""
    return law if isinstance(law, str) else law.model_dump()


Law: TypeAlias = Annotated[
    str | StatedLaw,
    PlainValidator(_read, json_schema_input_type=Name | StatedLaw),
    PlainSerializer(_written),
]
