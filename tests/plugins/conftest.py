"""Installed distributions, laid out as pip leaves them."""

import sys
import textwrap

import pytest


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Lay out a distribution with one module and put it on the path."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def lay_out(distribution, source, version="1.2"):
        module = distribution.replace("-", "_")
        (tmp_path / f"{module}.py").write_text(textwrap.dedent(source), encoding="utf-8")
        info = tmp_path / f"{module}-{version}.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {distribution}\nVersion: {version}\n", encoding="utf-8"
        )
        (info / "entry_points.txt").write_text(
            f"[gradedesign]\n{distribution} = {module}\n", encoding="utf-8"
        )

    before = set(sys.modules)
    yield lay_out
    for name in set(sys.modules) - before:
        if name.startswith("fake_"):
            del sys.modules[name]
