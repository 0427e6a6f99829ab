"""Take the pictures of README, tutorial and cases from finished runs: ``make pictures``.

Every picture beside a case is replaced by the one of its name in ``runs/<case>``, where that holds
a result; the tutorial's by those of its own run, and README opens with four of the flagship's.
"""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Iterator
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).parents[1]
#: Cases of the tutorial and at the top of README, and its pictures from left to right and down.
TUTORIAL, FLAGSHIP = "bar", "engine-bracket"
SHOWN = ("loads.png", "density.png", "lattice.png", "stress.png")
#: Pixels across the four together, and colours of a file: what a page needs, in a fifth of the
#: bytes.
WIDTH, COLOURS = 1200, 256


def is_finished(run: Path) -> bool:
    """Whether a run folder holds a verdict."""
    result = run / "result.json"
    if not result.is_file():
        return False
    status = json.loads(result.read_text(encoding="utf-8"))["status"]
    return status in ("met", "not_met", "infeasible")


def compact(picture: Image.Image) -> bytes:
    """A picture as a file of few colours."""
    out = io.BytesIO()
    picture.quantize(COLOURS, dither=Image.Dither.NONE).save(out, format="PNG", optimize=True)
    return out.getvalue()


def picture_of(path: Path) -> Image.Image:
    """A picture of a run, in the colours of a screen."""
    with Image.open(path) as picture:
        return picture.convert("RGB")


def pictures_of_cases(root: Path) -> Iterator[tuple[Path, bytes]]:
    """Every picture beside a case with the one that its finished run has for it."""
    for picture in sorted(root.glob("cases/*/*.png")):
        run = root / "runs" / picture.parent.name
        if is_finished(run) and (run / picture.name).is_file():
            yield picture, compact(picture_of(run / picture.name))


def pictures_of_tutorial(root: Path) -> Iterator[tuple[Path, bytes]]:
    """The tutorial's pictures with those that its finished run has for them."""
    run = root / "runs" / TUTORIAL
    for name in SHOWN if is_finished(run) else ():
        yield root / "docs" / "pictures" / f"tutorial-{name}", compact(picture_of(run / name))


def four_together(run: Path) -> bytes:
    """The flagship's pictures as one."""
    tiles = [picture_of(run / name) for name in SHOWN]
    width, height = tiles[0].size
    whole = Image.new("RGB", (2 * width, 2 * height), "white")
    for k, tile in enumerate(tiles):
        whole.paste(tile.resize((width, height)), (k % 2 * width, k // 2 * height))
    size = WIDTH, round(WIDTH * height / width)
    return compact(whole.resize(size, Image.Resampling.LANCZOS))


def main(root: Path = ROOT) -> None:
    """Write every picture of which a finished run is at hand, and say which."""
    found = [*pictures_of_cases(root), *pictures_of_tutorial(root)]
    run = root / "runs" / FLAGSHIP
    if is_finished(run):
        found.append((root / "docs" / "pictures" / "flagship.png", four_together(run)))
    for picture, data in found:
        picture.write_bytes(data)
        sys.stdout.write(f"{picture.relative_to(root)}\n")
    if not found:
        where = root / "runs"
        sys.stdout.write(f"no finished run below {where}: gradedesign run cases/{FLAGSHIP}\n")


if __name__ == "__main__":
    main()
