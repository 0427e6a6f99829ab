"""Sized mass of the bar for two cell sizes."""

from pathlib import Path

import gradedesign

folder = Path(__file__).parent
text = (folder / "case.toml").read_text()
text = text.replace("[run]", '[run]\nstop_after = "sizing"')

for size in (8, 12):
    variant = folder / f"size-{size}.toml"
    variant.write_text(text.replace('size = "12 mm"', f'size = "{size} mm"'))
    case = gradedesign.load_case(variant)
    result = gradedesign.run(case, folder=Path(f"runs/bar-{size}"), overwrite=True)
    values = ", ".join(f"{row.name} {row.value:.4g} {row.unit}" for row in result.limits)
    print(f"{size} mm: {result.mass_g:.2f} g; {values}")
    variant.unlink()
