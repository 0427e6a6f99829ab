"""``[material]``: a name from the library, a record, or the properties themselves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field, ValidationInfo, model_validator

from gradedesign.common.values.suggest import listed
from gradedesign.common.values.table import Table, key_error
from gradedesign.common.values.value_types import FilePath, Name, Number, Quantity
from gradedesign.errors import CaseError
from gradedesign.mechanics.material.record_file import recorded, with_record

_NEEDED = ("youngs_modulus", "poissons_ratio", "density")
#: Keys of a record beside the properties: what they are of, and from where.
_TEXTS = ("name", "source")


class MaterialSpec(Table):
    """Either ``name`` or ``file`` alone, from the library or a record, or its own properties."""

    example: ClassVar[str] = '{name = "Ti-6Al-4V"}'

    called: ClassVar[Mapping[str, str]] = {
        "material": "name",
        "e": "youngs_modulus",
        "elastic_modulus": "youngs_modulus",
        "nu": "poissons_ratio",
        "rho": "density",
        "alpha": "thermal_expansion",
        "cte": "thermal_expansion",
    }

    name: Name | None = Field(default=None, examples=["Ti-6Al-4V"])
    """Name in the library."""
    file: FilePath | None = Field(default=None, examples=["m290-ti64.toml"])
    """Record of what was measured, whose table ``[material]`` states the properties."""
    youngs_modulus: Annotated[float, Quantity("stress", above=0.0)] | None = Field(
        default=None, examples=["114 GPa"]
    )
    """Young's modulus of the solid material, MPa."""
    poissons_ratio: Annotated[float, Number(above=-1.0, below=0.5)] | None = Field(
        default=None, examples=[0.34]
    )
    """Poisson's ratio."""
    density: Annotated[float, Quantity("density", above=0.0)] | None = None
    """Mass density of the solid material, t/mm^3."""
    yield_strength: Annotated[float, Quantity("stress", above=0.0)] | None = Field(
        default=None, examples=["880 MPa"]
    )
    """Stress at which the solid material yields, MPa; needed for a safety factor."""
    thermal_expansion: Annotated[float, Quantity("thermal_expansion")] | None = None
    """Coefficient of thermal expansion, 1/K; needed for a temperature change."""

    @model_validator(mode="before")
    @classmethod
    def _recorded(cls, value: Any, info: ValidationInfo) -> Any:
        return with_record(value, info, "material", cls, texts=_TEXTS)

    def texts(self) -> tuple[str, str]:
        """Name and source of a stated material.

        Raises `CaseError` if the record that it is from is gone.
        """
        if self.file is None:
            return "stated in the case", "stated in the case"
        try:
            found = recorded(self.file, "material")
        except ValueError as error:
            raise CaseError(str(error)) from None
        name, source = (str(found.get(key, self.file.stem)) for key in _TEXTS)
        return name, source

    @model_validator(mode="after")
    def _complete(self) -> MaterialSpec:
        if self.name is not None:
            extra = [k for k in type(self).model_fields if k in self.model_fields_set - {"name"}]
            if extra:
                raise key_error(
                    extra[0],
                    "found beside name; expected either a name from the library or the "
                    "properties without a name",
                )
            return self
        missing = [k for k in _NEEDED if getattr(self, k) is None]
        if missing:
            raise ValueError(
                f"found no name and no {listed(missing)}; expected a name from the library such "
                f'as name = "Ti-6Al-4V", or all of {listed(_NEEDED)}'
            )
        return self
