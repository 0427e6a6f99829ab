"""A transition, or a parameter by place, as zones: sizing knows cells by their zones."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gradedesign.geometry.lattice.by_place_schema import ParameterMapSpec, TransitionSpec
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.lattice.zone_schema import WeightedZone


def weighted_zones(lattice: LatticeSpec) -> tuple[LatticeSpec, tuple[WeightedZone, ...]]:
    """The lattice outside zones, and zones for its transition or for the values of its parameter.

    None without either. The first value of the parameter is that of the lattice, and every other
    one a zone whose weight rises where its value is reached from the one before, so that two
    neighbours mix.
    """
    if lattice.transition is not None:
        return lattice, (_of_transition(lattice.transition),)
    spec = lattice.parameter_map
    if spec is None or spec.formula is None:
        return lattice, ()
    values = [float(value) for value in np.linspace(*spec.values, spec.increments)]
    parameters = {**lattice.parameters, spec.parameter: values[0]}
    zones = tuple(_of_value(lattice, spec, low, high) for low, high in pairwise(values))
    return lattice.model_copy(update={"parameters": parameters}), zones


def _of_transition(spec: TransitionSpec) -> WeightedZone:
    return WeightedZone.model_construct(
        name=spec.cell,
        cell=spec.cell,
        parameters=dict(spec.parameters),
        share=spec.weight,
        between=(0.0, 1.0),
        within_values=(0.0, 1.0),
        quantity="weight of the transition",
        stated_by="lattice.transition",
    )


def _of_value(
    lattice: LatticeSpec, spec: ParameterMapSpec, before: float, value: float
) -> WeightedZone:
    low, high = sorted(spec.values)
    return WeightedZone.model_construct(
        name=f"{spec.parameter} {value:g}",
        parameters={**lattice.parameters, spec.parameter: value},
        # The law that the case names, of all values; auto computes that of each.
        law=lattice.law,
        share=spec.formula,
        between=(before, value),
        within_values=(low, high),
        quantity=f"formula of {spec.parameter}",
        stated_by="lattice.parameter_map",
    )
