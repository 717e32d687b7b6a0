#!/usr/bin/env python3
"""Keeps the options in docs/reference/command-line/ those of the program.

  tools/command_reference.py RELIEF [--check | --write]

RELIEF is the built program. A page holds the options of a command between the lines <!-- options: COMMAND --> and <!-- end -->.
--check, the default, prints one line for each page that differs, each command without a page, and each page without a command.
--write puts the options in their places. Options that every command has stand on docs/reference/command-line.md, by hand;
those of relief-studio stand on its page, by hand, and their names are compared.
Exit status: 0 all is well, 1 something differs, 2 wrong usage.
"""

import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGES = ROOT / "docs" / "reference" / "command-line"
INDEX = PAGES.with_suffix(".md")
BLOCK = re.compile(r"(<!-- options: ([\w-]+) -->\n)(.*?)(<!-- end -->\n)", re.S)
GENERAL = "General"
STUDIO = "studio"


def ask(program, *words):
    return subprocess.run([program, *words], capture_output=True, text=True, check=True, timeout=60).stdout


def typed(option):
    """`-o, --output MODEL.relief`, as people type it; no bar in it, which would end a cell."""
    names = ", ".join(option["names"]).replace("|", " or ")
    value = option["placeholder"]
    if value and ("|" in value or value in ("TEXT", "INT")):
        value = option["names"][-1].lstrip("-").upper()
    if value and not option.get("positional"):
        names += f"[={value}]" if option.get("optional_value") else f" {value}"
    return f"`{names}`"


def readable(numbers):
    """`0 to 1e9` for 0 to 1000000000, and `1,000` for 1000."""
    def one(match):
        zeros = len(match.group()) - len(match.group().rstrip("0"))
        return f"{match.group()[:-zeros]}e{zeros}" if zeros >= 9 else f"{int(match.group()):,}"
    return re.sub(r"(?<![\d.e-])\d{4,}(?![\d.e])", one, numbers)


def meaning(option):
    """The meaning, then range or choices, and what it needs or excludes."""
    text = re.sub(r"(?<![\w`-])--[a-z-]+", r"`\g<0>`", option["meaning"].rstrip("."))
    if option["range"]:
        text += f"; {readable(option['range'])}"
    if not all(re.search(rf"\b{re.escape(choice)}\b", text) for choice in option["choices"]):
        text += ": " + ", ".join(f"`{choice}`" for choice in option["choices"])
    for word, names in (("needs", option["needs"]), ("not with", option["excludes"])):
        if names:
            text += f"; {word} " + ", ".join(f"`{name}`" for name in names)
    return text.replace("|", "\\|")


def table(options):
    rows = ["| Option | Default | Meaning |", "|---|---|---|"]
    for option in options:
        default = "required" if option["required"] else option["default"] or ""
        rows.append(f"| {typed(option)} | {default} | {meaning(option)} |".replace("|  |", "| |"))
    return "\n".join(rows) + "\n"


def options_text(command):
    """The tables of a command, one for each section of its options."""
    everything = [{**one, "positional": True} for one in command["positionals"]] + command["options"]
    sections = {}
    for option in everything:
        if option["section"] != GENERAL:
            sections.setdefault(option["section"] or "", []).append(option)
    parts = [(f"**{name}**\n\n" if name else "") + table(options) for name, options in sections.items()]
    parts.append(f"{'And the' if parts else 'Only the'} [options of every command](../command-line.md#in-every-command).\n")
    return "\n".join(parts)


def filled_in(block, commands):
    """A block with the options of its command, as it is where there is no such command."""
    command = commands.get(block.group(2))
    return block.group(1) + (f"\n{options_text(command)}\n" if command else block.group(3)) + block.group(4)


def long_names(text):
    return set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", text)) - {"--help"}


def offences(program, write):
    """One line for each thing that differs; with `write` the options are put right first."""
    commands = {one["command"]: one for one in json.loads(ask(program, "help", "--json"))["commands"]}
    seen = set()
    for page in sorted(PAGES.glob("*.md")):
        text = page.read_text(encoding="utf-8")
        where = page.relative_to(ROOT)
        names = {match.group(2) for match in BLOCK.finditer(text)}
        for name in sorted(names - commands.keys()):
            yield f"{where}: relief has no command {name}"
        if not names:
            yield f"{where}: no line <!-- options: COMMAND -->"
        seen |= names & commands.keys()
        filled = BLOCK.sub(lambda m: filled_in(m, commands), text)
        if filled != text and write:
            page.write_text(filled, encoding="utf-8")
        elif filled != text:
            yield f"{where}: its options are not those of the program; run tools/command_reference.py RELIEF --write"
        if page.stem not in INDEX.read_text(encoding="utf-8"):
            yield f"{where}: {INDEX.relative_to(ROOT)} does not name it"
    for name in sorted(commands.keys() - seen):
        yield f"{(PAGES / name).relative_to(ROOT)}.md: the command {name} has no page"
    yield from studio_offences(program)
    yield from general_offences(commands)


def studio_offences(program):
    """The options of the window, which is a program of its own; nothing where it was not built."""
    window = pathlib.Path(program).with_name("relief-studio")
    if window.exists():
        page = (PAGES / f"{STUDIO}.md").read_text(encoding="utf-8")
        for name in sorted(long_names(ask(window, "--help")) - long_names(page)):
            yield f"{STUDIO}.md: does not name {name} of relief-studio"


def general_offences(commands):
    """The options of every command, which stand on the index."""
    known = long_names(INDEX.read_text(encoding="utf-8"))
    general = {name for one in commands.values() for option in one["options"] if option["section"] == GENERAL
               for name in option["names"] if name.startswith("--")} - {"--help"}
    for name in sorted(general - known):
        yield f"{INDEX.relative_to(ROOT)}: does not name {name}"


def main(arguments):
    flags = [word for word in arguments if word.startswith("-")]
    programs = [word for word in arguments if not word.startswith("-")]
    if len(programs) != 1 or len(flags) > 1 or set(flags) - {"--check", "--write"}:
        print(__doc__, file=sys.stderr)
        return 2
    found = list(offences(programs[0], "--write" in flags))
    print("\n".join(found) if found else "the command reference is that of the program")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
