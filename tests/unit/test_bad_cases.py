"""Wrong case files: each is refused with its line, what was found and what would be right.

Rows are those of the table of faults of the quality reference, 39 to 58.
"""

import os

import pytest
from small_parts import box_part, held_bar

from gradedesign.design.case.read_case import load_case
from gradedesign.errors import CaseError

CASE = (
    held_bar(
        box_part(60, 20, 20, 4),
        name="bracket",
        material='youngs_modulus = "200 GPa"\npoissons_ratio = 0.3\ndensity = "7.85 g/cm^3"',
        load_case="tip load",
        force="0 N, 0 N, -50 N",
    )
    + """\
[limits]
stress = "50 MPa"
displacement = [{region = "tip", magnitude = "2 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = [0.10, 0.65]
skin = {thickness = "1 mm"}
[print]
min_wall = "0.8 mm"
[run]
memory = "8 GB"
[output]
formats = ["stl"]
"""
)


def write(folder, text):
    path = folder / "case.toml"
    path.write_text(text)
    return path


def refusal(folder, text, **options):
    path = folder / "case.toml"
    path.write_text(text)
    with pytest.raises(CaseError) as caught:
        load_case(path, **options)
    return str(caught.value)


def swapped(old, new):
    assert CASE.count(old) == 1, old
    return CASE.replace(old, new)


def line_number(text):
    return CASE[: CASE.index(text)].count("\n") + 1


# old text, new text, words of the message; the line of the message is that of the old text
WRONG = [
    # row 40: unknown keys
    ('magnitude = "2 mm"', 'magnitud = "2 mm"', ['did you mean "magnitude"?', "valid keys:"]),
    (
        'cell = "gyroid-sheet"',
        'sell = "gyroid-sheet"',
        ['sell: unknown key; did you mean "cell"?'],
    ),
    ("force =", "farce =", ['load_case[0].load[0].farce: unknown key; did you mean "force"?']),
    ("[output]", "[outputs]", ['outputs: unknown table; did you mean "output"?']),
    (
        'plane = "x = max"',
        'plan = "x = max"',
        ["region.tip.plan: unknown key; did you mean"],
    ),
    # row 41: wrong words
    (
        'memory = "8 GB"',
        'acceptance = "hole"',
        ['did you mean "whole"? available: auto'],
    ),
    ('"x = max"', '"w = max"', ["available: x, y, z"]),
    ('"x = max"', '"x = maxx"', ["or min or max"]),
    (
        'plane = "x = max"',
        'facing = "z"',
        ['did you mean "+z" or "-z"?', "available: +x, -x, +y, -y, +z, -z"],
    ),
    ('["stl"]', '["stl", 3]', ["found 3; expected the name of a format"]),
    ('["stl"]', '["stl", "stl"]', ["twice"]),
    # row 42: units and dimensions
    ('"200 GPa"', '"200"', ["without a unit", 'for instance "200 MPa"']),
    ('"200 GPa"', "200", ["without a unit", '"200 MPa"']),
    ('"-50 N"', '"-50 mm"', ["entry 3", "which is a length", "expected a force"]),
    ('"8 GB"', '"8 min"', ["which is a time", "expected an amount of memory"]),
    ("poissons_ratio = 0.3", 'poissons_ratio = "0.3"', ["plain number without quotes"]),
    # row 43: hostile quantities
    ('"200 GPa"', '"9**9**9"', ["not a number followed by a unit"]),
    ('"200 GPa"', "\"__import__('os').getcwd()\"", ["not a number followed by a unit"]),
    # row 44: impossible properties
    ('"200 GPa"', '"-200 GPa"', ["above 0"]),
    ('"200 GPa"', '"0 GPa"', ["above 0"]),
    ("poissons_ratio = 0.3", "poissons_ratio = 0.5", ["above -1 and below 0.5"]),
    ("poissons_ratio = 0.3", "poissons_ratio = -1", ["above -1 and below 0.5"]),
    ("poissons_ratio = 0.3", "poissons_ratio = nan", ["finite"]),
    ('"7.85 g/cm^3"', '"0 g/cm^3"', ["above 0"]),
    # 200 GPa / 20 = 10 GPa is beyond any strength; no yield strength is stated
    ('stress = "50 MPa"', 'stress = "10.1 GPa"', ["found 10100 MPa", "twentieth", "beyond_yield"]),
    # row 45: limits and sizes
    ('stress = "50 MPa"', 'stress = "0 MPa"', ["above 0"]),
    ('magnitude = "2 mm"', 'magnitude = "-2 mm"', ["above 0"]),
    ("[0.10, 0.65]", "[0.0, 0.65]", ["above 0 and below 1"]),
    ("[0.10, 0.65]", "[0.1, 1]", ["above 0 and below 1"]),
    ('skin = {thickness = "1 mm"}', 'skin = {thickness = "0 mm"}', ["above 0"]),
    ('skin = {thickness = "1 mm"}', 'skin = {thicknes = "1 mm"}', ['did you mean "thickness"?']),
    ('min_wall = "0.8 mm"', 'min_wall = "0 mm"', ["above 0"]),
    ('"60 mm", "20 mm"', '"60 mm", "-20 mm"', ["entry 2", "a length above 0 mm"]),
    ('stress = "50 MPa"', 'stress = "50 MPa"\npercentile = 50', []),
    ('memory = "8 GB"', 'memory = "8 kB"', ["at least 0.1 GB"]),
    ('memory = "8 GB"', "max_iterations = 0", ["at least 1"]),
    ('memory = "8 GB"', "elements_per_wall = 0.1", ["at least 0.25"]),
    ('memory = "8 GB"', 'time = "0 s"', ["at least 1 s"]),
    # slips of the keyboard or of the unit: nothing that is built has such a value
    (
        "poissons_ratio = 0.3",
        'poissons_ratio = 0.3\nthermal_expansion = "109 1/K"',
        ["between 1e-06 um/m/K and 10000 um/m/K in magnitude"],
    ),
    ('"-50 N"', '"1e300 N"', ["entry 3", "force between 1e-12 N and 1e+12 N", "unit right?"]),
    ('size = "8 mm"', 'size = "1 km"', ["unknown unit"]),
    ('size = "8 mm"', 'size = "1000 m"', ["at least 1 um and at most 100000 mm"]),
    ('size = "8 mm"', 'size = "1e-6 mm"', ["at least 1 um and at most 100000 mm"]),
    ('mesh_size = "4 mm"', 'mesh_size = "1e300 mm"', ["a length between", "unit right?"]),
    ('["60 mm",', '["1e300 mm",', ["entry 1", "a length between", "unit right?"]),
    ('["60 mm",', '["1e-4 mm",', ["entry 1", "at least 0.001 mm"]),
    (
        'plane = "x = min"',
        'cylinder = {radius = "4 mm"}',
        ["by its diameter", 'write diameter = "8 mm"'],
    ),
    ('plane = "x = min"', "cylinder = {raduis = 4}", ["raduis", "by its diameter"]),
    ('memory = "8 GB"', 'time = "1 ms"', ["a time of at least 1 s"]),
    # degrees that are the radians of a usual angle, and more than a turn
    (
        'min_wall = "0.8 mm"',
        'min_wall = "0.8 mm"\noverhang_angle = "0.785 deg"',
        ["print.overhang_angle", "45 deg in radians", '"45 deg"', '"0.785 rad"', "0.0137008 rad"],
    ),
    (
        'size = "8 mm"',
        'size = "8 mm"\nrotation = ["0 deg", "0 deg", "-1.5708 deg"]',
        ["lattice.rotation: entry 3", "90 deg in radians"],
    ),
    (
        'size = "8 mm"',
        'size = "8 mm"\nrotation = ["45 rad", "0 deg", "0 deg"]',
        ["entry 1", "an angle between", "360 deg", "unit right?"],
    ),
    # one quantity limited twice
    (
        '[{region = "tip", magnitude = "2 mm"}]',
        '[{region = "tip", magnitude = "2 x solid"},\n'
        '{region = "tip", magnitude = "3 mm", load_case = "tip load"}]',
        ["found 3 mm", "allows 2 x solid", "state load_case in both"],
    ),
    # names
    (
        '{region = "tip", force',
        '{region = "tipp", force',
        ['not defined; did you mean "tip"?'],
    ),
    ('magnitude = "2 mm"', 'magnitude = "2 mm", load_case = "tip"', ["defined: tip load"]),
    ('plane = "x = max"', 'any = ["root", "lip"]', ["region.tip.any[1]", 'did you mean "tip"?']),
    # rows 53 and 55
    ('fix = [{region = "root"}]', "fix = []", ["has no support", 'fix = [{region = "root"}]']),
    # shapes
    ('fix = [{region = "root"}]', 'fix = ["root"]', ["fix[0]", "expected a table"]),
    ('name = "bracket"', 'name = ""', ["1 to 80 printable characters"]),
    ('name = "bracket"', 'name = "a\\u0000b"', ["printable"]),
    ('name = "bracket"', "name = 0x" + "f" * 5000, ["a whole number beyond 1e18"]),
    ('mesh_size = "4 mm"', 'mesh_size = "4 mm"\nunits = "mm"', []),
    # known, but not there yet
    ('cell = "gyroid-sheet"', 'cell = "a"\ngrading = "thick"', ['did you mean "thickness"']),
    ('size = "8 mm"', 'size = ["4 mm", "8 mm"]', ['grading = "level"', "goes with one length"]),
    ('skin = {thickness = "1 mm"}', "skin = {net = true}", ["thickness: missing"]),
    ('["stl"]', '["stl", "stl"]', ["a format twice"]),
]


@pytest.mark.parametrize(("old", "new", "words"), WRONG, ids=[f"{n[:36]!a}" for _, n, _ in WRONG])
def test_wrong_entry_is_told_with_its_line(tmp_path, old, new, words):
    message = refusal(tmp_path, swapped(old, new))
    head, *told = message.split("\n")
    assert str(tmp_path / "case.toml") in head
    line = line_number(old) + new.count("\n")  # an added row is the wrong one
    fitting = [t for t in told if t.startswith(f"case.toml:{line}: ")]
    assert any(all(word in t for word in words) for t in fitting), message


def test_limits_of_other_quantities_are_no_repetition(tmp_path):
    both = (
        '[{region = "tip", magnitude = "2 mm"}, {region = "root", magnitude = "2 mm"}, '
        '{region = "tip", component = "z", magnitude = "1 mm"}]'
    )
    case = load_case(write(tmp_path, swapped('[{region = "tip", magnitude = "2 mm"}]', both)))
    assert len(case.limits.displacement) == 3


@pytest.mark.parametrize(("written", "read"), [("z", "+z"), ("-y", "-y"), ("x", "+x")])
def test_an_axis_alone_is_the_positive_direction(tmp_path, written, read):
    stated = f'min_wall = "0.8 mm"\nbuild_direction = "{written}"'
    case = load_case(write(tmp_path, swapped('min_wall = "0.8 mm"', stated)))
    assert case.print.build_direction == read


PLANNED = [
    ('stress = "50 MPa"', 'stress = "50 MPa"\nsafety_factor = 2', "found beside stress"),
    ('mesh_size = "4 mm"', 'mesh_size = "4 mm"\nunits = "mm"', "has no meaning with box"),
    (
        'density = "7.85 g/cm^3"\n',
        'density = "7.85 g/cm^3"\nyield_strength = "49 MPa"\n',
        "found 50 MPa, above the yield strength of 49 MPa",
    ),
    (
        'stress = "50 MPa"',
        "beyond_yield = true",
        "limits.beyond_yield: has no meaning without stress",
    ),
    (
        'youngs_modulus = "200 GPa"',
        'name = "316L"\nyoungs_modulus = "200 GPa"',
        "found beside name",
    ),
    (
        'stress = "50 MPa"\ndisplacement = [{region = "tip", magnitude = "2 mm"}]',
        "",
        "no limit given",
    ),
    ('cell = "gyroid-sheet"\n', "", 'lattice.cell: missing; add cell = "gyroid-sheet"'),
    ('box = ["60 mm", "20 mm", "20 mm"]\n', "", "neither of file and box"),
    (
        '[region.tip]\nplane = "x = max"',
        '[region.tip]\nany = ["root", "b"]\n[region.b]\nall = "tip"',
        "region.b: is defined by itself",
    ),
    (
        "[limits]",
        '[[load_case]]\nname = "tip load"\nfix = [{region = "root"}]\nacceleration = '
        '["1 g", "0 g", "0 g"]\n[limits]',
        'load_case[1].name: load case "tip load" is defined twice',
    ),
    (
        'plane = "x = max"',
        'box = {lower = ["0 mm", "0 mm", "0 mm"], upper = ["1 mm", "0 mm", "1 mm"]}',
        "found y = 0 mm",
    ),
    ('plane = "x = max"', 'not = "tip"', "case.toml:8: region.tip: is defined by itself"),
    ('plane = "x = max"', "count = 3", "case.toml:8: region.tip: the region selects nothing"),
    ('plane = "x = max"', 'plane = "x = max"\nclip = true', "no meaning without box"),
    ('plane = "x = max"', 'plane = "x = max"\nangle = "5 deg"', "no meaning without facing"),
    ('plane = "x = max"', 'plane = {axis = "x", normal = [1, 0, 0]}', "not a complete plane"),
    ("[output]", "[[output]]", "expected a table"),
]


@pytest.mark.parametrize(("old", "new", "words"), PLANNED, ids=[w for *_, w in PLANNED])
def test_contradiction_is_told(tmp_path, old, new, words):
    assert words in refusal(tmp_path, swapped(old, new))


def test_too_many_regions(tmp_path):
    extra = "".join(f'[region.r{i}]\nplane = "x = min"\n' for i in range(300))
    assert "found 302 regions; expected at most 300" in refusal(tmp_path, CASE + extra)


def test_no_load_case_at_all(tmp_path):
    start, end = CASE.index("[[load_case]]"), CASE.index("[limits]")
    message = refusal(tmp_path, CASE[:start] + CASE[end:])
    assert "load_case: missing; add [[load_case]]" in message


def test_all_problems_are_told_together_in_order(tmp_path):
    text = swapped('"200 GPa"', '"200"').replace('"8 mm"', '"8"').replace("tip load", "")
    head, *told = refusal(tmp_path, text.replace('region = "root"', 'region = "roof"')).split("\n")
    assert "4 problems" in head
    lines = [int(t.split(":")[1]) for t in told]
    assert len(told) == 4
    assert lines == sorted(lines)


def test_syntax_error_has_line_column_and_caret(tmp_path):
    # row 39; the position was counted by hand: row 5, the second "="
    message = refusal(tmp_path, swapped('mesh_size = "4 mm"', "mesh_size = = 2"))
    head, row, caret = message.split("\n")
    assert f"{tmp_path / 'case.toml'}:5:13: not valid TOML" in head
    assert row.strip() == "mesh_size = = 2"
    assert caret.index("^") - row.index("m") == 12


def test_unfinished_file_points_to_its_end(tmp_path):
    message = refusal(tmp_path, '[case]\nname = "a')
    assert "case.toml:2:" in message
    assert message.endswith("^")


def test_duplicate_key_is_a_syntax_error(tmp_path):
    assert "case.toml:3:" in refusal(tmp_path, '[case]\nname = "a"\nname = "b"\n')


HUGE = {
    "large": ("#" * 1_000_001, "larger than 1 MB"),
    "nested lists": ("a = " + "[" * 100_000, "nested deeper than 24"),
    "nested tables": ("a = " + "{a = " * 50_000, "nested deeper than 24"),
    "dotted key": (".".join(["a"] * 300_000) + " = 1", "more than 24 parts"),
    "many keys": ("\n".join(f"k{i} = 1" for i in range(80_000)), "more than 5000 entries"),
    "many entries": ("a = [" + "1," * 400_000 + "]", "more than 5000 entries"),
    "long number": ("a = " + "1" * 900_000, "not valid TOML"),
    "long text": ('[case]\nname = "' + "x" * 900_000 + '"', "1 to 80 printable"),
    "many regions": (
        "\n".join(f'[region.r{i}]\nany = "q{i}"' for i in range(1600)),
        "more problems",
    ),
    "open texts": ("a = " + '"""' * 200_000, "not valid TOML"),
}


@pytest.mark.timeout(60)
@pytest.mark.parametrize("kind", HUGE)
def test_huge_files_are_refused(tmp_path, kind):
    # row 47: no reader that needs time or memory beyond measure; 0.02 to 0.4 s, a hang ends here
    text, words = HUGE[kind]
    message = refusal(tmp_path, text)
    assert words in message
    assert len(message) < 20_000


@pytest.mark.parametrize(
    "content", [b"\xff\xfe", b"a = 1\nb = \x80\n", b"\x00" * 50, b"%PDF-1.4", b"<html>", b"a: b"]
)
def test_other_files_are_refused(tmp_path, content):
    path = tmp_path / "case.toml"
    path.write_bytes(content)
    with pytest.raises(CaseError, match=r"case\.toml"):
        load_case(path)


def test_missing_file_names_neighbours(tmp_path):
    (tmp_path / "bracket.toml").write_text(CASE)
    with pytest.raises(CaseError, match=r'did you mean "bracket\.toml"'):
        load_case(tmp_path / "braket.toml")
    with pytest.raises(CaseError, match="no such case file"):
        load_case(tmp_path)
    with pytest.raises(CaseError, match="no such case file"):
        load_case("a\x00b")
    with pytest.raises(CaseError, match=r"no such case file|cannot be read"):
        load_case("x" * 5000)


def with_file(name):
    box = 'box = ["60 mm", "20 mm", "20 mm"]'
    return CASE.replace(box, f"file = '{name}'\nunits = \"mm\"")


OUTSIDE = [
    "/etc/passwd.stl",
    "../part.stl",
    "sub/../../part.stl",
    "~/part.stl",
    "file:///part.stl",
    "http://example.org/part.stl",
    r"\\server\share\part.stl",
    "//server/share/part.stl",
    r"C:\part.stl",
    r"..\part.stl",
    "link.stl",
    "folder/part.stl",
]


@pytest.mark.parametrize("name", OUTSIDE)
def test_part_outside_the_folder_is_refused(tmp_path, name):
    # row 46
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "part.stl").write_bytes(b"solid")
    (inside / "link.stl").symlink_to(tmp_path / "part.stl")
    (inside / "folder").symlink_to(tmp_path)
    message = refusal(inside, with_file(name))
    assert "case.toml:4: part.file: " in message
    assert "allow_outside=True" in message


@pytest.mark.parametrize("name", ["../part.stl", "link.stl", "{full}"])
def test_part_outside_the_folder_may_be_allowed(tmp_path, name):
    inside = tmp_path / "inside"
    inside.mkdir()
    part = tmp_path / "part.stl"
    part.write_bytes(b"solid")
    (inside / "link.stl").symlink_to(part)
    (inside / "case.toml").write_text(with_file(name.format(full=part)))
    assert load_case(inside, allow_outside=True).part.file == part


def test_part_file_must_exist_be_a_file_and_be_readable(tmp_path):
    (tmp_path / "bracket.stl").write_bytes(b"solid")
    (tmp_path / "folder.stl").mkdir()
    (tmp_path / "loop.stl").symlink_to(tmp_path / "loop.stl")
    os.mkfifo(tmp_path / "pipe.stl")
    assert 'did you mean "bracket.stl"?' in refusal(tmp_path, with_file("braket.stl"))
    assert "not a regular file" in refusal(tmp_path, with_file("folder.stl"))
    assert "not a regular file" in refusal(tmp_path, with_file("pipe.stl"))
    assert "part.file" in refusal(tmp_path, with_file("loop.stl"))
    assert "part.file" in refusal(tmp_path, with_file("x" * 900 + ".stl"))
    assert "expected a name with a suffix" in refusal(tmp_path, with_file("bracket"))
    assert "found a list of 1" in refusal(
        tmp_path, with_file("bracket.stl").replace("'bracket.stl'", '["bracket.stl"]')
    )
    text = with_file("bracket.stl")
    assert "both of file and box" in refusal(
        tmp_path, text.replace("[part]", '[part]\nbox = ["6 mm", "6 mm", "6 mm"]')
    )


def test_size_effects_are_on_unless_switched_off(tmp_path):
    assert load_case(write(tmp_path, CASE)).lattice.size_effects
    off = swapped('size = "8 mm"', 'size = "8 mm"\nsize_effects = false')
    assert not load_case(write(tmp_path, off)).lattice.size_effects
    assert "size_effects" in refusal(tmp_path, off.replace("false", '"walls"'))
