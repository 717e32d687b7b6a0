"""A part of the benchmark program in its shortest form: only what it says is tested, never how fast."""

import os
import pathlib
import subprocess

PROGRAM = pathlib.Path(os.environ["RELIEF_BIN"]).parent / "relief-bench"


def run(part, *arguments):
    return subprocess.run([str(PROGRAM), part, "--form", *arguments], capture_output=True, text=True, timeout=280,
                          check=False)


def numbers(value, where=""):
    """All numbers of a JSON value, with where they stand."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from numbers(inner, f"{where}/{key}")
    elif isinstance(value, list):
        for k, inner in enumerate(value):
            yield from numbers(inner, f"{where}/{k}")
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield where, value
