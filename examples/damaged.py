#!/usr/bin/env python3
"""Makes a damaged scan, for the pages on bad scans: damaged.py hole|overlap|boxes|letters|strip|scattered FILE.off"""

import math
import random
import sys


def grid(place, rows, columns):
    """Triangles of a sheet whose corner in row i and column j is place(i, j)."""
    for i in range(rows):
        for j in range(columns):
            a, b, c, d = place(i, j), place(i + 1, j), place(i + 1, j + 1), place(i, j + 1)
            yield from ((a, b, c), (a, c, d))


def ball(x):
    """A ball of radius 10 about (x, 0, 0)."""
    def place(i, j):
        down, round_it = math.pi * i / 16, 2 * math.pi * (j % 32) / 32
        ring = 0 if i in (0, 16) else 10 * math.sin(down)
        return x + ring * math.cos(round_it), ring * math.sin(round_it), 10 * math.cos(down)
    return [corners for corners in grid(place, 16, 32) if len(set(corners)) == 3]


def block(low, high):
    """A box from one corner to the opposite one."""
    corner = [tuple((low, high)[k >> axis & 1][axis] for axis in range(3)) for k in range(8)]
    faces = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    return [tuple(corner[k] for k in t) for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]


def letters():
    """L, E and H of strokes that overlap, half sunk in a plate; the foot of the L touches the E."""
    strokes = ((0, 0, 1, 6), (0.3, 0, 4, 1),
               (4, 0, 5, 6), (4.3, 0.2, 7, 1.2), (4.3, 2.5, 6.5, 3.5), (4.3, 4.8, 7, 5.8),
               (8, 0, 9, 6), (8.3, 2.5, 10.8, 3.5), (10.5, 0, 11.5, 6))
    plate = block((-1, -1, -1.5), (12.5, 7, 0))
    return plate + [corners for a, b, c, d in strokes for corners in block((a, b, -0.7), (c, d, 1.5))]


def strip():
    """A strip of paper, twisted by half a turn and glued: it has one side only."""
    def place(i, j):
        turn, across = 2 * math.pi * (i % 40) / 40, (2 * j - 3) * (-1 if i == 40 else 1)
        out = 20 + across * math.cos(turn / 2)
        return out * math.cos(turn), out * math.sin(turn), across * math.sin(turn / 2)
    return list(grid(place, 40, 3))


def scattered():
    """Triangles here and there, each through others."""
    at = random.Random(3).uniform
    for _ in range(200):
        middle = [at(-10, 10) for _ in range(3)]
        yield tuple(tuple(m + at(-4, 4) for m in middle) for _ in range(3))


KINDS = {
    "hole": lambda: [corners for corners in ball(0) if corners[0][2] <= 8],
    "overlap": lambda: ball(0) + ball(8),
    "boxes": lambda: block((0, 0, 0), (20, 12, 12)) + block((12, 6, 4), (30, 20, 20)),
    "letters": letters,
    "strip": strip,
    "scattered": scattered,
}


def main(arguments):
    if len(arguments) != 2 or arguments[0] not in KINDS:
        print(__doc__, file=sys.stderr)
        return 2
    numbers, faces = {}, []
    for corners in KINDS[arguments[0]]():
        names = ["{:.9g} {:.9g} {:.9g}".format(*corner) for corner in corners]
        faces.append("3 {} {} {}".format(*(numbers.setdefault(name, len(numbers)) for name in names)))
    with open(arguments[1], "w", encoding="ascii") as file:
        print("OFF", f"{len(numbers)} {len(faces)} 0", *numbers, *faces, sep="\n", file=file)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
