"""Sized mass of the bar for several cell sizes."""

from pathlib import Path

import gradedesign

folder = Path(__file__).parent
text = (folder / "case.toml").read_text()

for size in (8, 12, 16):
    variant = folder / f"size-{size}.toml"
    variant.write_text(
        text.replace('size = "12 mm"', f'size = "{size} mm"').replace(
            "[run]", '[run]\nstop_after = "sizing"'
        )
    )
    case = gradedesign.load_case(variant)
    variant.unlink()
    result = gradedesign.run(case, folder=Path(f"runs/bar-{size}"), overwrite=True)
    uses = ", ".join(f"{row.name} {row.use:.0%}" for row in result.limits)
    print(f"{size} mm: {result.mass_g:.2f} g; {uses}")
