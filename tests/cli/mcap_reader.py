"""Reads MCAP 0 as its specification (https://mcap.dev/spec) has it, without compression, and checks all of it."""

import json
import struct
import zlib

MAGIC = b"\x89MCAP0\r\n"


class Fields:
    """The content of a record, field by field."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, count):
        assert self.at + count <= len(self.data), "a record ends early"
        self.at += count
        return self.data[self.at - count:self.at]

    def number(self, size):
        return int.from_bytes(self.take(size), "little")

    def sized(self, size=4):
        return self.take(self.number(size))

    def text(self):
        return self.sized().decode("utf-8")

    def map(self, key, value):
        inner, found = Fields(self.sized()), {}
        while inner.at < len(inner.data):
            k = key(inner)
            assert k not in found
            found[k] = value(inner)
        return found

    def end(self):
        assert self.at == len(self.data), "a record has more than its fields"


def records(data, start, end):
    """(opcode, offset of the record, content) of the records between two offsets."""
    at = start
    while at < end:
        length = struct.unpack_from("<Q", data, at + 1)[0]
        assert at + 9 + length <= end, "a record runs over its section"
        yield data[at], at, data[at + 9:at + 9 + length]
        at += 9 + length
    assert at == end


class Mcap:
    """metadata, schemas, channels, messages [(channel id, sequence, log time, object)]."""

    def __init__(self, data):
        assert data.startswith(MAGIC) and data.endswith(MAGIC)
        self.metadata, self.schemas, self.channels, self.messages = {}, {}, {}, []
        self.definitions = []  # schema and channel records, whole
        footer_at = len(data) - 8 - 29
        assert data[footer_at] == 2 and struct.unpack_from("<Q", data, footer_at + 1)[0] == 20
        summary, offsets, crc = struct.unpack_from("<QQI", data, footer_at + 9)
        assert crc == zlib.crc32(data[summary:footer_at + 25])
        chunks = self.read_data(data, summary)
        self.read_summary(data, summary, offsets, chunks)
        self.read_offsets(data, summary, offsets, footer_at)

    def define(self, op, data):
        f = Fields(data)
        self.definitions.append((op, data))
        if op == 3:
            number = f.number(2)
            assert number != 0
            self.schemas[number] = (f.text(), f.text(), json.loads(f.sized()))
        else:
            number, schema = f.number(2), f.number(2)
            assert schema in self.schemas
            self.channels[number] = (schema, f.text(), f.text(), f.map(Fields.text, Fields.text))
        f.end()

    def read_data(self, data, end):
        """The data section. Returns what the chunk indexes must say."""
        chunks, ended, indexes = [], False, {}
        for k, (op, at, content) in enumerate(records(data, 8, end)):
            assert not ended and (op == 1) == (k == 0)
            f = Fields(content)
            if op == 1:
                f.text(), f.text()
            elif op == 12:
                name = f.text()
                self.metadata[name] = (at, 9 + len(content), f.map(Fields.text, Fields.text))
            elif op == 6:
                first, last, size, crc = f.number(8), f.number(8), f.number(8), f.number(4)
                assert f.text() == ""
                inner = f.sized(8)
                assert len(inner) == size and crc == zlib.crc32(inner)
                indexes, times = self.read_chunk(inner)
                assert (first, last) == ((min(times), max(times)) if times else (0, 0))
                chunks.append([first, last, at, 9 + len(content), {}, 0, size])
            elif op == 7:
                channel = f.number(2)
                entries = Fields(f.sized())
                while entries.at < len(entries.data):
                    time, place = entries.number(8), entries.number(8)
                    assert indexes[channel].pop(0) == (time, place)
                assert not indexes.pop(channel)
                chunks[-1][4][channel] = at
                chunks[-1][5] += 9 + len(content)
            elif op == 15:
                assert not indexes, "messages without an index"
                f.number(4)
                ended = True
            else:
                raise AssertionError(f"opcode {op} in the data section")
            f.end()
        assert ended
        return chunks

    def read_chunk(self, inner):
        indexes, times = {}, []
        for op, at, content in records(inner, 0, len(inner)):
            if op in (3, 4):
                self.define(op, content)
                continue
            assert op == 5
            f = Fields(content)
            channel, sequence, log, publish = f.number(2), f.number(4), f.number(8), f.number(8)
            assert channel in self.channels and publish <= log
            self.messages.append((channel, sequence, log, json.loads(f.data[f.at:])))
            indexes.setdefault(channel, []).append((log, at))
            times.append(log)
        return indexes, times

    def read_summary(self, data, start, end, chunks):
        defined, order, found, metadata = [], [], [], {}
        for op, _, content in records(data, start, end):
            if not order or order[-1] != op:
                assert op not in order, "records of the summary are not grouped"
                order.append(op)
            f = Fields(content)
            if op in (3, 4):
                defined.append((op, content))
                continue
            if op == 8:
                found.append([f.number(8) for _ in range(4)] +
                             [f.map(lambda x: x.number(2), lambda x: x.number(8)), f.number(8)])
                assert f.text() == ""
                stored, size = f.number(8), f.number(8)
                assert stored == size
                found[-1].append(size)
            elif op == 11:
                counts = [f.number(8), f.number(2), *(f.number(4) for _ in range(4)), f.number(8), f.number(8)]
                times = [m[2] for m in self.messages] or [0]
                assert counts == [len(self.messages), len(self.schemas), len(self.channels), 0, len(self.metadata),
                                  len(chunks), min(times), max(times)], counts
                per = f.map(lambda x: x.number(2), lambda x: x.number(8))
                assert sum(per.values()) == len(self.messages) and set(per) <= set(self.channels)
            elif op == 13:
                place = f.number(8), f.number(8)
                metadata[f.text()] = place
            else:
                raise AssertionError(f"opcode {op} in the summary")
            f.end()
        assert sorted(defined) == sorted(self.definitions)
        assert found == chunks
        assert metadata == {name: entry[:2] for name, entry in self.metadata.items()}

    @staticmethod
    def read_offsets(data, summary, start, end):
        groups = {}
        for op, at, content in records(data, summary, start):
            begin, length = groups.get(op, (at, 0))
            groups[op] = (begin, length + 9 + len(content))
        for op, _, content in records(data, start, end):
            assert op == 14
            f = Fields(content)
            group = f.number(1)
            assert groups.pop(group) == (f.number(8), f.number(8))
            f.end()
        assert not groups
