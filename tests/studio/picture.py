"""Pictures of the screen: crops, comparisons, and PNG files for people."""

import array
import struct
import zlib


class Picture:
    """width x height words 0x00RRGGBB, row by row from the top. (x, y): where its upper left corner is on the screen."""

    def __init__(self, width, height, words, x=0, y=0):
        assert len(words) == width * height, (width, height, len(words))
        self.width, self.height, self.words, self.x, self.y = width, height, words, x, y

    @staticmethod
    def read(file, width, height, x=0, y=0):
        """From raw words, as studio_hand grabs them."""
        words = array.array("I")
        words.frombytes(file.read_bytes())
        return Picture(width, height, words, x, y)

    def __eq__(self, other):
        return (self.width, self.height, self.words) == (other.width, other.height, other.words)

    def row(self, y):
        return self.words[y * self.width:(y + 1) * self.width]

    def crop(self, rect):
        """The part within (x, y, width, height) of the screen."""
        x, y, width, height = rect
        x, y = x - self.x, y - self.y
        assert 0 <= x and 0 <= y and x + width <= self.width and y + height <= self.height, (rect, self.width, self.height)
        words = array.array("I")
        for line in range(y, y + height):
            words.extend(self.words[line * self.width + x:line * self.width + x + width])
        return Picture(width, height, words, x + self.x, y + self.y)

    def at(self, x, y):
        """(red, green, blue) of a pixel of the screen."""
        return channels(self.words[(y - self.y) * self.width + x - self.x])

    def mirrored(self):
        """Left and right exchanged."""
        words = array.array("I")
        for y in range(self.height):
            words.extend(reversed(self.row(y)))
        return Picture(self.width, self.height, words, self.x, self.y)

    def differing(self, other, tolerance=0):
        """How many pixels have a channel that differs by more than `tolerance` levels."""
        return sum(1 for _ in self._differences(other, tolerance))

    def difference_box(self, other, tolerance=0):
        """(x, y, width, height) on the screen of all that differs; None where nothing does."""
        places = self.places(other, tolerance)
        if not places:
            return None
        xs, ys = [p[0] for p in places], [p[1] for p in places]
        return (min(xs), min(ys), max(xs) - min(xs) + 1, max(ys) - min(ys) + 1)

    def places(self, other, tolerance=0):
        """(x, y) on the screen of each pixel that differs."""
        return [(i % self.width + self.x, i // self.width + self.y) for i in self._differences(other, tolerance)]

    def _differences(self, other, tolerance):
        assert (self.width, self.height) == (other.width, other.height)
        if self.words == other.words:
            return
        for i, (a, b) in enumerate(zip(self.words, other.words)):
            if a != b and any(abs(p - q) > tolerance for p, q in zip(channels(a), channels(b))):
                yield i

    def squared_error(self, other):
        """The mean over pixels and channels, levels squared."""
        total = 0
        for a, b in zip(self.words, other.words):
            if a != b:
                total += sum((p - q) ** 2 for p, q in zip(channels(a), channels(b)))
        return total / (3 * len(self.words))

    def write_png(self, file):
        rows = bytearray()
        for y in range(self.height):
            rows.append(0)
            raw = self.row(y).tobytes()
            line = bytearray(3 * self.width)
            line[0::3], line[1::3], line[2::3] = raw[2::4], raw[1::4], raw[0::4]
            rows += line

        def chunk(kind, body):
            return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

        file.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", self.width, self.height, 8, 2, 0, 0, 0)) +
                         chunk(b"IDAT", zlib.compress(bytes(rows), 1)) + chunk(b"IEND", b""))


def channels(word):
    return word >> 16 & 255, word >> 8 & 255, word & 255
