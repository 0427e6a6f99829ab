"""Mistakes of typing: which one, where, and what to write instead."""

import pytest
from small_parts import box_part, held_bar

from gradedesign.case.read_case import load_case
from gradedesign.case.suggest import described, meant
from gradedesign.errors import CaseError
from gradedesign.plugin.registry import build_registry, lookup

CASE = (
    held_bar(box_part(60, 20, 20, 4), force="0 N, 0 N, -50 N")
    + """\
[limits]
stress = "20 MPa"
[lattice]
cell = "walls"
size = "8 mm"   # of a cell
"""
)

#: Old text, new text, words that say what to write, the line counted from that of the old text.
TYPED = {
    "no quotes": ('size = "8 mm"', "size = 8 mm", 'write size = "8 mm"', 0),
    "no quotes, a word": ('cell = "walls"', "cell = bcc-wave", 'write cell = "bcc-wave"', 0),
    "no quotes in a list": (
        '"0 N", "0 N", "-50 N"', '"0 N", 0 N, "-50 N"', 'stand in quotes; write "0 N"', 0,
    ),
    "no end quote": ('size = "8 mm"', 'size = "8 mm', 'of its quotes; write size = "8 mm"', 0),
    "no first quote": ('size = "8 mm"', 'size = 8 mm"', 'write size = "8 mm"', 0),
    "no end quote in a list": (
        '"0 N", "0 N", "-50 N"', '"0 N, "0 N", "-50 N"', "text in load lacks one of its", 0,
    ),
    "curly quotes": (
        'size = "8 mm"', "size = \u201c8 mm\u201d", 'none of a keyboard; write size = "8 mm"', 0,
    ),
    "key twice": (
        'size = "8 mm"', 'size = "8 mm"\nsize = "9 mm"',
        "size stands here again, first in line {first}; leave one out", 1,
    ),
    "table twice": (
        "[limits]", '[material]\nname = "PLA"\n[limits]',
        "[material] stands here again, first in line {material}; put their keys together", 0,
    ),
    "no value": ('size = "8 mm"', "size =", "size has no value", 0),
}  # fmt: skip


def refusal(folder, text):
    (folder / "case.toml").write_text(text, encoding="utf-8")
    with pytest.raises(CaseError) as caught:
        load_case(folder)
    return str(caught.value)


def line_of(text, words):
    return text[: text.index(words)].count("\n") + 1


@pytest.mark.parametrize(("old", "new", "words", "down"), TYPED.values(), ids=TYPED)
def test_what_to_write_is_told(tmp_path, old, new, words, down):
    assert CASE.count(old) == 1
    told = refusal(tmp_path, CASE.replace(old, new)).split("\n")[0]
    first = line_of(CASE, old)
    assert f"case.toml:{first + down}:" in told
    assert "not valid TOML" in told
    assert words.format(first=first, material=line_of(CASE, "[material]")) in told


@pytest.mark.parametrize(
    ("typed", "meant_text"),
    [
        ("\u221250 N", "-50 N"),
        ("\u201350 N", "-50 N"),
        ("-50\u00a0N", "-50 N"),
        ("-0,5 kN", "-0.5 kN"),
    ],
)
def test_signs_that_no_keyboard_has(tmp_path, typed, meant_text):
    told = refusal(tmp_path, CASE.replace('"-50 N"', f'"{typed}"'))
    assert "load_case[0].load[0].force: entry 3" in told
    assert f'write "{meant_text}"' in told


KEYS = {
    "young": ('name = "PA12"', 'young = "2 GPa"', 'did you mean "youngs_modulus"?'),
    "yield": ('name = "PA12"', 'yield = "2 MPa"', 'did you mean "yield_strength"?'),
    "table of a key": ("[limits]", "[solver]\n[limits]", "unknown table, but [run] has solver"),
    "key of a table below": (
        'cell = "walls"', 'cell = "walls"\ndirections = ["1", "0", "0"]',
        "lattice.directions: unknown key, but [lattice.orientation] has direction",
    ),
    "dashes": (
        "[limits]", '[run]\nanalysis = "finite_cells"\n[limits]', 'did you mean "finite-cells"?',
    ),
}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "words"), KEYS.values(), ids=KEYS)
def test_the_key_that_is_meant(tmp_path, old, new, words):
    assert CASE.count(old) == 1
    assert words in refusal(tmp_path, CASE.replace(old, new))


@pytest.mark.parametrize(
    ("kind", "word", "guesses"),
    [
        ("cell_families", "gyroid", ("gyroid-network", "gyroid-sheet", "gyroid-wall")),
        ("cell_families", "schwarz-p", ("primitive-sheet", "primitive-wall", "primitive-network")),
        ("cell_families", "Gyroid Sheet", ("gyroid-sheet",)),
        ("materials", "316L stainless", ("316L",)),
        ("materials", "Aluminium", ("AlSi10Mg", "Scalmalloy")),
        ("materials", "nylon", ("PA11", "PA12")),
    ],
)
def test_the_names_that_are_meant(kind, word, guesses):
    with pytest.raises(CaseError) as caught:
        lookup(build_registry(), kind, word)
    question = str(caught.value).partition("did you mean ")[2].partition("?")[0]
    assert {word.strip('"') for word in question.replace(" or ", ", ").split(", ")} == set(guesses)


def test_no_word_is_guessed_from_nothing():
    assert meant("xyzzy", ["bcc", "octet"]) == ()
    assert meant("a", ["bcc", "abc"]) == ()
    assert described("of", {"bcc": "struts of a cube"}) == ()
