"""Masses of both methods on shipped cases: sizing by gradients beside stress to density.

``python benchmarks/bench_plain_method.py [NAME ...] [--law LAW] [--into FOLDER]``; ``mini``,
``bracket`` and ``ramirez-cantilever`` by default, minutes each. Every case runs
with each method, both by the power law fitted to its cell (or LAW, such as ``auto``) and with the
acceptance that the case states, up to the verdict. The beam is shipped to end after sizing, where
both methods are compared as predicted.
"""

import argparse
import shutil
from pathlib import Path

CASES = Path(__file__).parents[1] / "cases"
NAMES = ("mini", "bracket", "ramirez-cantilever")


def ran(name, into, values, label):
    """Result of a case with some keys replaced, in a folder of its own."""
    from gradedesign import load_case, run

    folder = into / f"{name}-{label}"
    shutil.rmtree(folder, ignore_errors=True)
    return run(load_case(CASES / name, values=values), folder=folder)


def row(name, label, result, reference):
    """One line of the table."""
    first = result.iterations[0].measured if result.iterations else ()
    off = ", ".join(f"{limit.label} {limit.discrepancy:+.0%}" for limit in first)
    limits = [f"{limit.name} {limit.utilisation:.1%}" for limit in result.limits]
    share = "" if reference is None else f"{result.mass_g / reference:.3f}"
    return (
        f"| `{name}` | {label} | {result.status} | {result.mass_g:.4g} | {share} | "
        f"{result.lattice_density:.3f} | {len(result.iterations)} | {off} | {'; '.join(limits)} |"
    )


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", default=NAMES)
    parser.add_argument("--law", default="gibson-ashby")
    parser.add_argument("--into", type=Path, default=Path("runs") / "plain-method")
    stated = parser.parse_args()
    stated.into.mkdir(parents=True, exist_ok=True)
    columns = ("case", "method", "status", "mass g", "of sized", "lattice density", "iterations",
               "law off by", "used")  # fmt: skip
    print(f"| {' | '.join(columns)} |\n{'|---' * len(columns)}|")
    law = {"lattice.law": stated.law}
    for name in stated.names:
        sized = ran(name, stated.into, law, "lightest")
        print(row(name, f"lightest, {stated.law}", sized, None), flush=True)
        plain = {**law, "lattice.method": "stress-to-density"}
        mapped = ran(name, stated.into, plain, "stress-to-density")
        print(row(name, f"stress-to-density, {stated.law}", mapped, sized.mass_g), flush=True)


if __name__ == "__main__":
    main()
