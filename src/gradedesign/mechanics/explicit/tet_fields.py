"""Solved displacements on quadratic tetrahedra, in the protocol of explicit analyses."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.progress import report_step
from gradedesign.geometry.tets.point_location import locate
from gradedesign.geometry.tets.tet_mesh import TetMesh, boundary_surface, centroids, signed_volumes
from gradedesign.mechanics.explicit.analysis import (
    Discretisation,
    StressSample,
    SurfaceFields,
    VolumeFields,
)
from gradedesign.mechanics.fe.element_points import element_points, interpolate
from gradedesign.mechanics.fe.load_case import region_nodes, region_shares
from gradedesign.mechanics.fe.solution import Solution
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stiffness import dense_stiffness
from gradedesign.mechanics.fe.stress import element_stress, element_von_mises, nodal_average
from gradedesign.mechanics.finite_cell.traction_residual import GoalResidual
from gradedesign.mechanics.material.material import Material


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TetFields:
    """Solved displacements on the quadratic tetrahedra of a printed solid."""

    space: TetSpace
    material: Material
    solutions: Mapping[str, Solution]  #: By load case.
    thermal_strain: Mapping[str, float]  #: By load case.
    facets: Mapping[str, IntArray]  #: By region, ``(k, 3)``.
    work: Mapping[str, float]  #: By load case, N mm.
    division: Discretisation
    #: Natural frequencies, Hz, and load factors of the modes of the printed solid.
    mode_values: Mapping[Hashable, float] = field(default_factory=dict)

    @property
    def load_cases(self) -> tuple[str, ...]:
        """Names, in the order of the case."""
        return tuple(self.solutions)

    @property
    def points(self) -> FloatArray:
        """Centroids, ``(3, M)``, mm."""
        return centroids(self.space.mesh)

    @property
    def volumes(self) -> FloatArray:
        """Volumes of the tetrahedra, ``(M,)``, mm^3."""
        return signed_volumes(self.space.mesh)

    def displacement(self, load_case: str) -> FloatArray:
        """Nodal displacements, ``(3, N)``, mm."""
        return self.solutions[load_case].displacement

    @property
    def traction_residual(self) -> Mapping[str, float]:
        """Not known of tetrahedra."""
        return {}

    @property
    def goal_residuals(self) -> Mapping[Hashable, GoalResidual]:
        """Likewise."""
        return {}

    def von_mises(self, load_case: str) -> FloatArray:
        """Von Mises stress at the Gauss points, ``(M, 4)``, MPa."""
        return element_von_mises(
            self.space,
            dense_stiffness(self.space, self.material),
            self.displacement(load_case),
            thermal_strain=self.thermal_strain[load_case],
        )

    def stress_within(self, load_case: str, lower: FloatArray, upper: FloatArray) -> StressSample:
        """Stress at the Gauss points in the box between two corners, mm."""
        driving = self.space
        corners = driving.mesh.points[:, driving.mesh.tets]
        touching = np.all(
            (corners.max(axis=1) > lower[:, None]) & (corners.min(axis=1) < upper[:, None]), axis=0
        )
        chosen = np.flatnonzero(touching)
        used, local = np.unique(driving.mesh.tets[:, chosen], return_inverse=True)
        mesh = TetMesh(points=driving.mesh.points[:, used], tets=np.asarray(local).reshape(4, -1))
        nodes, inverse = np.unique(driving.elements[:, chosen], return_inverse=True)
        part = TetSpace(
            mesh=mesh,
            order=2,
            nodes=driving.nodes[:, nodes],
            elements=np.asarray(inverse, dtype=np.int32).reshape(10, -1),
        )
        sample = gauss_stress(
            part,
            self.material,
            self.displacement(load_case)[:, nodes],
            self.thermal_strain[load_case],
        )
        inside = np.all(
            (sample.points >= lower[:, None]) & (sample.points <= upper[:, None]), axis=0
        )
        return StressSample(
            points=sample.points[:, inside],
            volumes=sample.volumes[inside],
            stress=sample.stress[:, :, inside],
        )

    def displacement_at(self, load_case: str, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Displacement at points, ``(3, m)``, mm, and their distances from the mesh, (m,), mm."""
        tets, barycentric, distance = locate(self.space.mesh, points)
        return interpolate(self.space, self.displacement(load_case), tets, barycentric), distance

    def region_displacement(self, region: str, load_case: str) -> FloatArray:
        """Displacements of the nodes of a region, ``(3, k)``, mm."""
        nodes = region_nodes(self.space, self.facets[region])
        return self.displacement(load_case)[:, nodes]

    def mean_displacement(self, region: str, load_case: str) -> FloatArray:
        """Mean displacement over the area of the facets of a region, ``(3,)``, mm."""
        shares = region_shares(self.space, self.facets[region])
        mean: FloatArray = self.region_displacement(region, load_case) @ shares
        return mean

    def mean_length(self, region: str, load_case: str) -> float:
        """Mean length of the displacement over the area of the facets of a region, mm."""
        lengths = np.linalg.norm(self.region_displacement(region, load_case), axis=0)
        return float(lengths @ region_shares(self.space, self.facets[region]))

    def largest_displacement(self, load_case: str) -> float:
        """Largest displacement of any node, mm."""
        return float(np.linalg.norm(self.displacement(load_case), axis=0).max())

    def surface_fields(self, load_case: str) -> SurfaceFields:
        """Boundary facets with stress averaged at the vertices."""
        report_step("stress for the pictures")
        at_vertices = element_von_mises(
            self.space,
            dense_stiffness(self.space, self.material),
            self.displacement(load_case),
            thermal_strain=self.thermal_strain[load_case],
            at="vertices",
        )
        surface, used = boundary_surface(self.space.mesh)
        return SurfaceFields(
            surface=surface,
            von_mises=nodal_average(self.space, at_vertices)[used],
            displacement=self.displacement(load_case)[:, used],
        )

    def volume_fields(self, sampled: Mapping[str, FloatArray]) -> VolumeFields:
        """Quadratic tetrahedra with nodal displacements and fields ``(M,)``."""
        return VolumeFields(
            points=self.space.nodes,
            elements=self.space.elements.astype(np.int64),
            point_data={
                f"displacement {name} [mm]": self.displacement(name) for name in self.load_cases
            },
            element_data=sampled,
        )


def gauss_stress(
    space: TetSpace, material: Material, displacement: FloatArray, thermal_strain: float
) -> StressSample:
    """Stress at the four Gauss points of every element."""
    stress = element_stress(
        space, dense_stiffness(space, material), displacement, thermal_strain=thermal_strain
    )
    volumes = np.repeat(signed_volumes(space.mesh)[:, None] / 4.0, 4, axis=1)
    return StressSample(
        points=element_points(space).reshape(3, -1),
        volumes=volumes.ravel(),
        stress=stress.reshape(3, 3, -1),
    )
