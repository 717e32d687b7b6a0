#!/usr/bin/env python3
"""Reads a recording without Relief: read_recording.py REC.rlog. Prints the largest force and when it was."""

import ctypes
import math
import sqlite3
import struct
import sys

# region read
zstd = ctypes.CDLL("libzstd.so.1")  # the Python package zstandard does as well
zstd.ZSTD_decompress.restype = ctypes.c_size_t


def ticks(db):
    """Every tick as (number, {column: value})."""
    columns = db.execute("SELECT name, type FROM columns WHERE stream = 'tick' ORDER BY position").fetchall()
    codes = {"f64": "d", "f32": "f", "u64": "Q", "u32": "I", "i32": "i", "u8": "B"}
    row = struct.Struct("<" + "".join(codes[kind] for _, kind in columns))
    for first, count, blob in db.execute("SELECT first, count, data FROM ticks ORDER BY first"):
        size = count * row.size
        shuffled = ctypes.create_string_buffer(size)
        if zstd.ZSTD_decompress(shuffled, ctypes.c_size_t(size), blob, ctypes.c_size_t(len(blob))) != size:
            raise ValueError(f"the ticks from {first} on are damaged")
        plain = bytearray(size)
        for rank in range(row.size):  # byte `rank` of every row lies side by side
            plain[rank::row.size] = shuffled.raw[rank * count:(rank + 1) * count]
        for number, values in enumerate(row.iter_unpack(plain), first):
            yield number, dict(zip((name for name, _ in columns), values))
# end read


# region use
db = sqlite3.connect(f"file:{sys.argv[1]}?mode=ro", uri=True)
facts = dict(db.execute("SELECT key, value FROM facts"))


def force(tick):
    return math.hypot(tick["force.x"], tick["force.y"], tick["force.z"])


number, strongest = max(ticks(db), key=lambda tick: force(tick[1]))
print(f"{facts['device']}: {force(strongest):.3f} N at tick {number}, t = {strongest['t']} s")
# end use
