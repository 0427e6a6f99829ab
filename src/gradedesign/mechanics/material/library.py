"""Printed alloys and polymers, each with the source of every figure.

The figures are for sizing, not for certification: the weakest direction of the stated condition is
taken, and the lower end where a source gives a range. A source text tells first what was **read**
in the named document, then what was **not traced**: figures in
general use that no document at hand confirmed. Replace those by your own before relying on them.
"""

from __future__ import annotations

from gradedesign.mechanics.material.material import Material

_EOS_316L = "EOS process data sheet StainlessSteel 316L-4441, EOS M 290, 20 um"
_SURVEY = "additive.tools survey of published powder-bed data"


def _material(
    *,
    name: str,
    modulus: float,
    nu: float,
    density: float,
    strength: float,
    expansion: float,
    source: str,
) -> Material:
    """Make a record from E in GPa, g/cm^3, yield in MPa and expansion in 1e-6/K."""
    return Material(
        name=name,
        youngs_modulus=modulus * 1e3,
        poissons_ratio=nu,
        density=density * 1e-9,
        yield_strength=strength,
        thermal_expansion=expansion * 1e-6,
        source=source,
    )


_METALS = (
    _material(
        name="Ti-6Al-4V",
        modulus=110.0,
        nu=0.34,
        density=4.41,
        strength=825.0,
        expansion=8.6,
        source="titanium alloy, "
        "laser powder bed fusion, annealed, any direction. Read: yield 825 MPa and E 110 "
        f"GPa, lower ends for LPBF annealed at 730-800 C in the {_SURVEY}, expansion 8.4-9.0e-6 "
        "there; 825 MPa is also the minimum of forged bar in JIS H 4657; density 4.41 g/cm^3 in a "
        "Ti64 sheet for EOS M machines. Not traced: that ASTM F2924 asks for the same 825 MPa; "
        "Poisson's ratio 0.34, of wrought material",
    ),
    _material(
        name="AlSi10Mg",
        modulus=70.0,
        nu=0.33,
        density=2.67,
        strength=213.0,
        expansion=20.0,
        source="aluminium (aluminum) alloy, "
        "laser powder bed fusion, as built, vertical. Read: yield 213 MPa in the EOS "
        "process data sheet AlSi10Mg, EOS M 300-4, 60 um (T6: 250 MPa); E 70 GPa along Z and "
        "density 2.67 g/cm^3 in the EOS data sheet AlSi10Mg as quoted by think3d. Not traced: "
        "Poisson's ratio 0.33, expansion 20e-6 1/K",
    ),
    _material(
        name="316L",
        modulus=180.0,
        nu=0.3,
        density=7.97,
        strength=480.0,
        expansion=15.72,
        source="stainless steel, "
        "laser powder bed fusion, as built, vertical. Read: yield 480 MPa, density at "
        f"least 7.97 g/cm^3 and expansion 15.72e-6 1/K at 25-100 C in the {_EOS_316L}. Not traced: "
        "E 180 GPa along Z, of the older EOS sheet for M 280; Poisson's ratio 0.3",
    ),
    _material(
        name="17-4PH",
        modulus=170.0,
        nu=0.28,
        density=7.8,
        strength=590.0,
        expansion=10.8,
        source="stainless steel, "
        "laser powder bed fusion, solution annealed and aged (H900). Not traced: no figure "
        "of a data sheet could be read. Yield 590 MPa is half of the 1170 MPa asked of wrought "
        "H900, since NIST (Lass, Stoudt, Williams 2019, read) finds nitrogen-atomised printed 17-4 "
        "at about half of wrought after the usual treatment; argon-atomised powder is stronger. "
        "E 170 GPa, density 7.8 g/cm^3, Poisson's ratio 0.28 and expansion 10.8e-6 1/K are in "
        "general use",
    ),
    _material(
        name="Inconel 718",
        modulus=170.0,
        nu=0.29,
        density=8.2,
        strength=920.0,
        expansion=12.8,
        source="nickel alloy, "
        "powder bed fusion, heat treated. Read: yield 920 MPa (electron beam) and 1000 MPa "
        "(laser) of machine makers' sheets as quoted by JAMPT, the lower is taken; density about "
        "8.2 g/cm^3 in the SLM Solutions sheet IN718 2023-11; Poisson's ratio 0.29 at 21 C in the "
        "Special Metals bulletin alloy 718; expansion 12.8e-6 1/K at 25-93 C in the High Temp "
        "Metals sheet. Not traced: E 170 GPa, of EOS sheets for printed, textured material "
        "(wrought: 200 GPa)",
    ),
    _material(
        name="Inconel 625",
        modulus=140.0,
        nu=0.28,
        density=8.44,
        strength=615.0,
        expansion=12.8,
        source="nickel alloy, "
        "laser powder bed fusion, as built, vertical. Read: density 8.44 g/cm^3 and "
        "Poisson's ratio 0.278 annealed at 21 C in Wikipedia's table of alloy 625; a machine "
        "maker's yield of 640 MPa as quoted by JAMPT. Not traced: yield 615 MPa and E 140 GPa "
        "along Z, of EOS sheets for printed, textured material (wrought: 207 GPa); "
        "expansion 12.8e-6 1/K of wrought bar",
    ),
    _material(
        name="Maraging 300",
        modulus=140.0,
        nu=0.3,
        density=8.0,
        strength=930.0,
        expansion=10.3,
        source="tool steel 1.2709, "
        "laser powder bed fusion, as built, not aged, building direction. Read: "
        "yield 930 +/- 150 MPa, E 140 +/- 25 GPa, density 8.0-8.1 g/cm^3 of EOS MaragingSteel MS1 "
        "as quoted by the University of Kragujevac (mfkv.kg.ac.rs). Aged at 490 C it is about "
        "twice as strong. Not traced: Poisson's ratio 0.3, expansion 10.3e-6 1/K",
    ),
    _material(
        name="CoCr",
        modulus=195.0,
        nu=0.29,
        density=8.29,
        strength=600.0,
        expansion=13.6,
        source="cobalt-chromium alloy CoCrMo "
        "(EOS CobaltChrome MP1), laser powder bed fusion, stress relieved. Read: "
        "yield 600 +/- 50 MPa, horizontal, in the EOS sheet as quoted by mirameccanica.it (as "
        "built: 1060); density 8.29 g/cm^3, E 195-220 GPa and expansion 12.8-14.0e-6 1/K in the "
        f"{_SURVEY}. Not traced: Poisson's ratio 0.29, expansion 13.6e-6 1/K within that range",
    ),
    _material(
        name="Scalmalloy",
        modulus=68.0,
        nu=0.33,
        density=2.67,
        strength=410.0,
        expansion=24.0,
        source="aluminium (aluminum) alloy Al-Mg-Sc-Zr, "
        "laser powder bed fusion, aged 325 C 4 h, vertical. Read: yield "
        f"410-485 MPa, E 68-74 GPa and density 2.67 g/cm^3 in the {_SURVEY}. Not traced: Poisson's "
        "ratio 0.33; expansion 24e-6 1/K, of wrought Al-Mg (the survey's 16.0-17.5e-6 looks "
        "too low)",
    ),
)

_POLYMERS = (
    _material(
        name="PA12",
        modulus=1.387,
        nu=0.39,
        density=0.93,
        strength=43.0,
        expansion=109.0,
        source="laser sintered polyamide (nylon) 12. "
        "Read: tensile strength 43 MPa and E 1387 MPa of 3D "
        "Systems PA12 (ASTM D638) in PMC10406103, table 2, strength used as yield; density 0.93 "
        f"g/cm^3 and yield 44-52 MPa in the {_SURVEY}. Not traced: Poisson's ratio 0.39, "
        "expansion 109e-6 1/K",
    ),
    _material(
        name="PA11",
        modulus=1.6,
        nu=0.39,
        density=0.97,
        strength=37.0,
        expansion=110.0,
        source="laser sintered polyamide (nylon) 11 "
        "(such as EOS PA 1101). Read: yield 37-48 MPa and "
        f"density 0.97 g/cm^3 in the {_SURVEY}, which gives E as 1-2 GPa. Not traced: E 1600 MPa, "
        "of the EOS sheet; Poisson's ratio 0.39, expansion 110e-6 1/K",
    ),
    _material(
        name="PEEK",
        modulus=4.0,
        nu=0.38,
        density=1.3,
        strength=90.0,
        expansion=55.0,
        source="polyether ether ketone, unfilled. Not traced: no data sheet could be read. E 4000 "
        "MPa and density 1.30 g/cm^3 are in general use for moulded Victrex 450G, 90 MPa for laser "
        "sintered EOS PEEK HP3; Poisson's ratio 0.38, expansion 55e-6 1/K. Printed by extrusion it "
        "is weaker, above all across layers",
    ),
    _material(
        name="PLA",
        modulus=2.539,
        nu=0.35,
        density=1.264,
        strength=26.0,
        expansion=101.0,
        source="polylactide by material extrusion, weaker direction. Read: tensile yield 26 MPa, E "
        "2539 MPa (XY), density 1.264 g/cm^3, expansion 101e-6 1/K in the Stratasys PLA sheet as "
        "quoted by pro3dcomposites.com (ASTM D638, D792, E831; XZ: 45 MPa, 3039 MPa). Not traced: "
        "Poisson's ratio 0.35",
    ),
    _material(
        name="Rigid resin",
        modulus=2.0,
        nu=0.38,
        density=1.17,
        strength=40.0,
        expansion=100.0,
        source="rigid, ABS-like photopolymer (Stratasys Vero). Read: E 2000-3000 MPa for the "
        "class, 2000-2500 MPa and tensile strength 40-55 MPa for Vero in PMC10406103, table 2; the "
        "lower ends are taken and strength is used as yield. Not traced: density 1.17 g/cm^3, "
        "Poisson's ratio 0.38, expansion 100e-6 1/K",
    ),
)


def builtin_materials() -> tuple[Material, ...]:
    """Return the materials that come with gradedesign, sorted by name."""
    return tuple(sorted((*_METALS, *_POLYMERS), key=lambda material: material.name))
