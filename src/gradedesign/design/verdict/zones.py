"""Plain data on the zones of a design: cells, densities, volumes, masses, transitions."""

from __future__ import annotations

from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.design.resolve.zoning import Zoning
from gradedesign.geometry.tets.tet_mesh import centroids
from gradedesign.mechanics.sizing.homogenised import solid_held
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel


def zone_data(zoning: Zoning | None) -> dict[str, Any]:
    """Cell and law of every zone, and the factors of the transitions; empty without zones."""
    if zoning is None:
        return {}
    return {
        "zones": {
            zone.name: {
                "cell": zoning.cells.members[zone.cell].name,
                "parameters": dict(zoning.cells.members[zone.cell].parameters),
                "law": zoning.laws[zone.cell].name,
                "density_bounds": list(zone.bounds),
            }
            for zone in zoning.zones
        },
        **_transitions(zoning),
    }


def zone_measures(
    model: HomogenisedModel, zoning: Zoning | None, rho: FloatArray
) -> dict[str, Any]:
    """Volume, mass and mean density of the lattice of every zone of a design; empty without zones.

    By the densities that sizing found, which the printed file follows. Where two zones pass into
    each other, each has its weight.

    Parameters
    ----------
    rho : (M,) array
    """
    if zoning is None:
        return {}
    weights = zoning.weights(centroids(model.space.mesh)) * model.lattice_volumes
    solid = weights @ solid_held(model, rho)
    volume, whole = weights.sum(axis=1), weights.sum()
    return {
        "zones": {
            zone.name: {
                "volume_mm3": float(volume[k]),
                "share_of_lattice": float(volume[k] / whole),
                "mass_g": float(solid[k] * model.material.density * 1e6),
                "density": float(solid[k] / volume[k]) if volume[k] > 0 else None,
            }
            for k, zone in enumerate(zoning.zones)
        }
    }


def _transitions(zoning: Zoning) -> dict[str, Any]:
    """Factors on stiffness and strength of the mixes between the cells that meet."""
    if not zoning.factors:
        return {}
    return {
        "transitions": [
            {
                "cells": [zoning.cells.members[i].name, zoning.cells.members[j].name],
                "share_of_second": np.asarray(mix.share).tolist(),
                "stiffness_factor": np.round(mix.stiffness, 4).tolist(),
                "strength_factor": np.round(mix.strength, 4).tolist(),
                "least_density": np.round(mix.low, 4).tolist(),
            }
            for (i, j), mix in zoning.factors.items()
        ]
    }
