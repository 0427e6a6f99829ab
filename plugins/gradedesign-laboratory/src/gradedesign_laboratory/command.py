"""``gradedesign homogenise``, ``gradedesign tabulate`` and ``gradedesign coupon`` as typed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gradedesign import completed

Strict = Annotated[
    bool, typer.Option("--strict-plugins", help="Stop if an installed plugin fails to load.")
]
Json = Annotated[bool, typer.Option("--json", help="Print plain data for another program.")]
Resolution = Annotated[
    int | None,
    typer.Option("--resolution", help="Voxels along the cell, even [what its wall needs]."),
]
Poisson = Annotated[float, typer.Option("--nu", help="Poisson's ratio of the base material.")]


def homogenise(
    cell: Annotated[
        str,
        typer.Argument(
            help="A cell family of `gradedesign cells`, or a case.",
            autocompletion=completed("cell_families"),
        ),
    ],
    density: Annotated[float, typer.Option("--density", help="Relative density, 0 to 1.")],
    resolution: Resolution = None,
    parameter: Annotated[
        list[str] | None,
        typer.Option("--parameter", help="name=number, overrides the cell's default; repeatable."),
    ] = None,
    boundary: Annotated[
        str,
        typer.Option(
            "--boundary",
            help="periodic; on a finite block: displacement, traction, mixed or macro-tet.",
        ),
    ] = "periodic",
    block_cells: Annotated[
        int | None,
        typer.Option("--cells", min=1, help="Cells along the edge of a finite block [1]."),
    ] = None,
    nu: Poisson = 0.3,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Folder for properties.json and plots."),
    ] = None,
    conductivity: Annotated[
        bool, typer.Option("--conductivity", help="Also the conductivity of the solid's paths.")
    ] = False,
    buckling: Annotated[
        bool, typer.Option("--buckling", help="Also the stresses that buckle the cell: minutes.")
    ] = False,
    eigen_solver: Annotated[
        str,
        typer.Option(
            "--eigen-solver",
            help="Of --buckling: lanczos, scipy or a plugin's.",
            autocompletion=completed("eigen_solvers"),
        ),
    ] = "lanczos",
    strict_plugins: Strict = False,
    as_json: Json = False,
) -> None:
    """Effective stiffness and strength of one cell: C, moduli, anisotropy, bounds, strength."""
    from gradedesign_laboratory.run_homogenise import Asked
    from gradedesign_laboratory.run_homogenise import homogenise as command

    options = Asked(
        cell=cell,
        density=density,
        boundary=boundary,
        cells=block_cells,
        resolution=resolution,
        parameters=parameter or [],
        poissons_ratio=nu,
        output=output,
        conductivity=conductivity,
        buckling=eigen_solver if buckling else None,
        strict_plugins=strict_plugins,
        as_json=as_json,
    )
    command(options)


def tabulate(
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Folder for one table per cell, as JSON.")
    ],
    cells: Annotated[
        list[str] | None,
        typer.Argument(
            help="Cells, or cases [all cells].", autocompletion=completed("cell_families")
        ),
    ] = None,
    resolution: Resolution = None,
    nu: Poisson = 0.3,
    workers: Annotated[
        int | None,
        typer.Option("--workers", min=1, help="Processes; several need dask [processors]."),
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", help="Address of a running dask cluster.")
    ] = None,
    buckling: Annotated[
        bool, typer.Option("--buckling", help="Critical stresses too: minutes per density.")
    ] = False,
    strict_plugins: Strict = False,
) -> None:
    """Compute property tables of cells over their densities, from which laws are made."""
    from gradedesign_laboratory.run_tabulate import tabulate as command

    raise typer.Exit(
        command(
            cells or [],
            output,
            resolution=resolution,
            poissons_ratio=nu,
            workers=workers,
            scheduler=scheduler,
            strict_plugins=strict_plugins,
            buckling=buckling,
        )
    )


def coupon(
    cell: Annotated[
        str | None,
        typer.Argument(
            help="A cell family of `gradedesign cells`.", autocompletion=completed("cell_families")
        ),
    ] = None,
    process: Annotated[
        str | None,
        typer.Option(
            "--process",
            help="Name of the process that is measured.",
            autocompletion=completed("processes"),
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Folder for plate, sheet and cases; with --read the record [PROCESS.toml].",
        ),
    ] = None,
    read: Annotated[
        Path | None, typer.Option("--read", help="A sheet that is filled in: fit it.")
    ] = None,
    material: Annotated[
        str | None,
        typer.Option(
            "--material",
            help="Base material of the library [that of the process].",
            autocompletion=completed("materials"),
        ),
    ] = None,
    density: Annotated[
        list[float] | None,
        typer.Option("--density", help="Of blocks; repeatable [0.2, 0.3, 0.4]."),
    ] = None,
    size: Annotated[
        list[str] | None, typer.Option("--size", help="Edge of a cell; repeatable [4 mm].")
    ] = None,
    block_cells: Annotated[
        int, typer.Option("--cells", help="Cells along the edge of a block.")
    ] = 4,
    copies: Annotated[
        int, typer.Option("--copies", min=1, help="Blocks of each density and size.")
    ] = 3,
    inclination: Annotated[
        list[float] | None,
        typer.Option(
            "--inclination", help="Of struts to the plate, deg; repeatable [0, 30, 45, 60, 90]."
        ),
    ] = None,
    width: Annotated[
        list[str] | None,
        typer.Option("--width", help="Of struts; repeatable [0.5 mm, 1 mm]."),
    ] = None,
    struts: Annotated[int, typer.Option("--struts", help="Struts on each coupon.")] = 5,
    strict_plugins: Strict = False,
    as_json: Json = False,
) -> None:
    """A build plate of coupons of a cell with a sheet to fill in; or the record of a filled one."""
    from gradedesign import CaseError
    from gradedesign_laboratory.run_coupon import PlateRequest, make_plate, read_coupons

    if read is not None:
        of_plates = (cell, process, material, density, size, inclination, width)
        if any(option is not None for option in of_plates):
            raise CaseError(
                "--read takes a sheet, which states cell, process, material and coupons; leave "
                "them out"
            )
        read_coupons(read, output, strict_plugins=strict_plugins, as_json=as_json)
        return
    if cell is None or process is None or output is None:
        raise CaseError(
            "expected a cell, --process and -o for a plate, or --read for a sheet, as in "
            "`gradedesign coupon octet --process m290-ti64 -o coupons`"
        )
    make_plate(
        PlateRequest(
            cell=cell,
            process=process,
            material=material,
            densities=density or [0.2, 0.3, 0.4],
            sizes=size or ["4 mm"],
            cells=block_cells,
            copies=copies,
            inclinations=inclination or [0.0, 30.0, 45.0, 60.0, 90.0],
            widths=width or ["0.5 mm", "1 mm"],
            struts=struts,
            output=output,
            strict_plugins=strict_plugins,
            as_json=as_json,
        )
    )
