"""Comparisons of the regression suite as JUnit XML, which continuous integration reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

from gradedesign.common.system.atomic import write_text


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """An expected quantity of a case and the value of this run.

    ``from_run``: the expected value is one that this program gave before, no reference.
    """

    case: str
    quantity: str
    value: Any
    expected: Any
    tolerance: str
    origin: str
    from_run: bool
    passed: bool


def short(value: Any) -> str:
    """A value for people to read."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def write_junit(
    path: Path, comparisons: Sequence[Comparison], seconds: Mapping[str, float]
) -> None:
    """Write a suite of each case, with a test of each expected quantity.

    ``seconds``: that its run took.
    """
    suites = Xml.Element("testsuites")
    for case in dict.fromkeys(c.case for c in comparisons):
        own = [c for c in comparisons if c.case == case]
        failed = [c for c in own if not c.passed]
        suite = Xml.SubElement(
            suites, "testsuite", name=case, tests=str(len(own)), failures=str(len(failed)),
            time=f"{seconds[case]:.1f}",
        )  # fmt: skip
        for c in own:
            test = Xml.SubElement(suite, "testcase", classname=case, name=c.quantity)
            if not c.passed:
                found = f"found {short(c.value)}, expected {short(c.expected)} ({c.tolerance})"
                Xml.SubElement(test, "failure", message=found).text = c.origin
    Xml.indent(suites)
    write_text(path, Xml.tostring(suites, encoding="unicode", xml_declaration=True) + "\n")
