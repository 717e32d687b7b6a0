#!/usr/bin/env python3
# Reads a model without Relief: read_model.py MODEL.relief. Prints what it holds.
# region read
import ctypes, sqlite3, struct, sys

db = sqlite3.connect(f"file:{sys.argv[1]}?mode=ro", uri=True)
meta = dict(db.execute("SELECT key, value FROM meta"))

zstd = ctypes.CDLL("libzstd.so.1")  # the Python package zstandard does as well
zstd.ZSTD_decompress.restype = ctypes.c_size_t
zstd.ZSTD_getFrameContentSize.restype = ctypes.c_ulonglong

def unpack(blob, width):
    size = zstd.ZSTD_getFrameContentSize(blob, ctypes.c_size_t(len(blob)))
    raw = ctypes.create_string_buffer(size)
    assert zstd.ZSTD_decompress(raw, ctypes.c_size_t(size), blob, ctypes.c_size_t(len(blob))) == size
    count = size // width
    out = bytearray(size)
    for rank in range(width):
        out[rank::width] = raw.raw[rank * count:(rank + 1) * count]
    return bytes(out)

def cage(part):
    return db.execute("SELECT data FROM cage WHERE part = ?", [part]).fetchone()[0]

if db.execute("SELECT count(*) FROM cage WHERE part NOT IN ('fibres', 'slabs')").fetchone()[0]:
    sys.exit("strokes have changed its cage, which this example does not follow")
fibres = list(struct.iter_unpack("<6d", unpack(cage("fibres"), 8)))
slabs = list(struct.iter_unpack("<4I", unpack(cage("slabs"), 4)))

def tile_bytes(slab):
    n = slabs[slab][3]
    return 4 * (n + 1) * (n + 2) // 2

def displacement(page, stroke):
    tiles = {}
    rows = db.execute("SELECT whole, tiles, data FROM pages WHERE layer = 'displacement' AND page = ? "
                      "AND stroke <= ? ORDER BY stroke", [page, stroke])
    for whole, mask, blob in rows:
        raw, at = unpack(blob, 4), 0
        for t in range(64):
            if mask >> t & 1:
                slab = 64 * page + t
                part = raw[at:at + tile_bytes(slab)]
                at += len(part)
                if not whole:
                    part = bytes(a ^ b for a, b in zip(part, tiles[slab]))
                tiles[slab] = part
    return {slab: struct.unpack(f"<{len(raw) // 4}f", raw) for slab, raw in tiles.items()}

print(meta["mode"], len(fibres), "fibres", len(slabs), "slabs, stroke", meta["current"], "of", meta["last"])
for number, label in db.execute("SELECT number, label FROM strokes WHERE number > 0 ORDER BY number"):
    print(number, label)
print("alpha at the first corner of slab 0:", displacement(0, meta["current"])[0][0])
# end read
