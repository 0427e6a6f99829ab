"""Files altered by chance, for tests that no content of a file ends in a traceback."""

from __future__ import annotations

import random
from collections.abc import Sequence

NASTY = [
    "nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "0", "-0.0", "-1", "9" * 30, "9" * 5000,
    "true", '""', '"\\u0000"', '"' + "a" * 500 + '"', '"../../etc/passwd"', '"/dev/zero"', '"."',
    "[]", "[[]]", "[" * 60, "{}", "[1, 2, 3]", '["x"]', '["1 mm", "1 mm"]', "1979-05-27",
    "07:32:00",
    '"1 mm"', '"0 mm"', '"-1 mm"', '"1e300 mm"', '"nan mm"', '"1 parsec"', '"5 kN mm"',
    '"1e-30 mm"',
    '"min"', '"x = max"', '"x = 1e400 mm"', "0x7fffffffffffffff", "0b1", "1_000", "'''", '"""',
    '"x +"', '"((((x"', '"x**x**x"', '"1/0"', '"sqrt(-1)"', '"exp(1e9)"', '"9**9**9"',
]  # fmt: skip


def altered_bytes(rng: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    """One to three changes of bytes, pieces cut, doubled, or taken from other files."""
    data = bytearray(data)
    for _ in range(rng.choice([1, 1, 2, 3])):
        kind = rng.choice([0, 0, 0, 0, 1, 2, 3, 4, 5, 6])
        a, b = sorted(rng.randrange(len(data) + 1) for _ in range(2))
        if kind == 0:
            for _ in range(rng.choice([1, 1, 6])):
                data[rng.randrange(len(data))] = rng.randrange(256)
        elif kind == 1:
            del data[a:]
        elif kind == 2:
            del data[a : min(b, a + 40)]
        elif kind == 3:
            data[a:a] = data[a:b]
        elif kind == 4:
            data[a : a + rng.randint(0, 8)] = rng.choice(NASTY).encode()
        elif kind == 5:
            data[a : a + 8] = rng.choice([b"\xff" * 8, bytes(8), b"\x7f" + bytes(7), b"\0\0\0\x80"])
        else:
            other = rng.choice(others)
            data[a:] = other[rng.randrange(len(other)) :]
        data = data or bytearray(b" ")
    return bytes(data)
