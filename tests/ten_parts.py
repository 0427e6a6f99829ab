"""Ten small parts with one feature each, as cases."""

HEAD = """
[case]
name = "{name}"
[part]
box = ["{x} mm", "{y} mm", "{z} mm"]
mesh_size = "3 mm"
[region.root]
plane = "{axis} = min"
[region.tip]
plane = "{axis} = max"
[material]
name = "Ti-6Al-4V"
[[keep]]
region = "root"
margin = "{root} mm"
"""
KEPT_TIP = """
[[keep]]
region = "tip"
margin = "{tip} mm"
"""
TAIL = """
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = [0.3, 0.31]
grading = "uniform"
{lattice}
{zones}
[run]
price = false
analysis = "finite-cells"
elements_per_wall = 0.7
max_iterations = 1
[output]
formats = ["stl"]
"""


def part(
    name, load, limit, *, box=(19, 8, 8), axis="x", root=1.5, tip=1.5, lattice="", zones="",
    regions="",
):  # fmt: skip
    """A case of cells of 8 mm behind solid ends, held at one of them unless the load says more."""
    x, y, z = box
    head = HEAD.format(name=name, x=x, y=y, z=z, axis=axis, root=root)
    kept = KEPT_TIP.format(tip=tip) if tip else ""
    loads = load if load.lstrip().startswith("[[") else f'[[load_case]]\nname = "load"\n{load}\n'
    tail = TAIL.format(lattice=lattice, zones=zones)
    return f"{head}{kept}{regions}{loads}[limits]\n{limit}\n{tail}"


HELD = 'fix = [{region = "root"}]\n'
TIP = 'displacement = [{region = "tip", magnitude = "1 mm"}]'
PLATE = {"box": (8, 8, 11), "axis": "z"}

#: Name of the feature to the case.
PARTS = {
    "pressure on a face": part(
        "face", f'{HELD}load = [{{region = "tip", pressure = "10 MPa"}}]', TIP, **PLATE
    ),
    "pressure on lattice": part(
        "open",
        f'{HELD}load = [{{region = "tip", pressure = "10 MPa"}}]',
        TIP,
        box=(8, 8, 9.5),
        axis="z",
        tip=0,
    ),
    "moment": part(
        "moment",
        f'{HELD}load = [{{region = "tip", moment = ["0 N mm", "500 N mm", "500 N mm"]}}]',
        TIP,
    ),
    "weight": part("weight", f'{HELD}acceleration = ["0 m/s^2", "0 m/s^2", "-50000 m/s^2"]', TIP),
    "heat": part(
        "heat",
        f'{HELD}temperature_change = "100 K"',
        'displacement = [{region = "tip", component = "z", magnitude = "1 mm"}]',
    ),
    "motion": part(
        "motion",
        'fix = [{region = "root"}, {region = "tip", displacement = ["free", "free", "0.1 mm"]}]',
        'displacement = [{region = "tip", component = "x", magnitude = "1 mm"}]',
    ),
    "skin": part(
        "skin",
        f'{HELD}load = [{{region = "tip", force = ["0 N", "0 N", "-200 N"]}}]',
        TIP,
        lattice='skin = [{thickness = "0.8 mm", faces = ["top", "bottom"]}]',
        regions='[region.top]\nplane = "z = max"\n[region.bottom]\nplane = "z = min"\n',
    ),
    "thin plate": part(
        "plate",
        f'{HELD}load = [{{region = "tip", pressure = "2 MPa"}}]',
        TIP,
        box=(8, 8, 10.3),
        axis="z",
        tip=0.8,
    ),
    "several cases": part(
        "cases",
        f'[[load_case]]\nname = "pull"\n{HELD}load = [{{region = "tip", force = ["900 N", "0 N", '
        f'"0 N"]}}]\n[[load_case]]\nname = "shear"\n{HELD}load = [{{region = "tip", force = '
        '["0 N", "90 N", "0 N"]}]\n',
        'displacement = [{region = "tip", magnitude = "1 mm"}]\n'
        'mean_displacement = [{region = "tip", component = "y", magnitude = "1 mm"}]',
    ),
    "two cells": part(
        "cells",
        f'{HELD}load = [{{region = "tip", force = ["0 N", "0 N", "-90 N"]}}]',
        TIP,
        box=(19, 8, 8),
        zones='[[zone]]\nname = "root"\nformula = "x - 9.5"\ncell = "primitive-sheet"\n'
        'density = [0.3, 0.31]\ntransition = "8 mm"\n',
    ),
}
