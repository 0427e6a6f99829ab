"""Namespaces of 3MF: the core specification, its extensions, and what slicers add."""

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
MATERIAL = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02}"
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06}"
ALTERNATIVES = "http://schemas.microsoft.com/3dmanufacturing/production/alternatives/2021/04}"
CURA = "http://software.ultimaker.com/xml/cura/3mf/2015/10}"
#: Extensions that messages call by their name.
EXTENSIONS = {
    ALTERNATIVES: "production alternatives",
    "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02}": "beam lattice",
    "http://schemas.microsoft.com/3dmanufacturing/slice/2015/07}": "slice",
    "http://schemas.microsoft.com/3dmanufacturing/securecontent/2019/04}": "secure content",
    "http://schemas.3mf.io/3dmanufacturing/volumetric/2022/01}": "volumetric",
}
