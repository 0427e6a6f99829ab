"""Comparisons of the regression suite as JUnit XML, which continuous integration reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree as Xml

from gradedesign.commands import write_text
from gradedesign_validate.expected_values import Comparison, short


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
