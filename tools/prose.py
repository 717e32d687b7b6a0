"""How a page of Markdown reads: what check_docs.py measures of its prose. The limits are those of docs/pages.tsv and of LIMITS.

A *text* is a paragraph, an item of a list or a cell of a table. A *word* holds a letter or a digit; a code span is one word.
Pictures, link targets, HTML comments and fenced code hold no words.
"""

import dataclasses
import re

LIMITS = {
    "paragraph": 90,  # words in a paragraph or an item
    "cell": 25,       # words in a cell
    "sentence": 35,   # words in any sentence
    "median": 18,     # words, half of a page's sentences have no more
    "ninetieth": 28,  # words, 90 % of a page's sentences have no more
    "commas": 5,      # commas and semicolons in a sentence
    "passive": 25,    # % of a page's sentences, where there are ten or more
    "alternative": 3,  # least words of a picture's alternative text
}

# What a reader outside the project stumbles over, and what to write instead.
WORDS = {
    r"the tool's side": "which side of the surface the tool is on",
    r"what is no \w+": "a file that is not a ...",
    r"worst minutes|quiet minutes": "median, 90th percentile, load",
    r"for all that|all the same": "nevertheless",
    r"but for": "except",
    r"(?:cannot|could not|can) be had": "is not available; is not reached",
    r"anew": "again",
    r"square to": "perpendicular to",
    r"in the open": "in free space",
    r"straight way": "straight segment",
    r"closed ways?": "closed path",
    r"meets? (?:itself|themselves)": "self-intersects",
    r"meets? others": "intersects other triangles",
    r"no direction sees": "no common front-facing direction",
    r"phantoms?": "fill triangle",
    r"specks?|crumbs?": "tiny component",
    r"sewn": "stitched",
    r"lets? go(?: of)?|letting go": "contact ends; releases",
    r"thorns?": "spike",
    r"some (?=\d)": "about",
    r"(?:is|are|was|were) told": "is reported",
    r"asked (?:was|were)|was asked|what is asked": "target",
    r"must take": "time limit",
    r"the world failed": "input, file or device failed",
    r"at the same place": "at identical coordinates",
    r"goes on (?:from )?there": "continues",
    r"a (?:tenth|fifteenth|twentieth|fiftieth)": "a percentage or a decimal",
    r"note that|please|simply|just|easily|obviously|of course": "(leave it out)",
    r"etc\.?": "the whole list, or \"for example\"",
}
HISTORY = r"used to|formerly|no longer|in the past|the (?:version|code|build) before"

FENCE = re.compile(r"^\s*(`{3,}|~{3,})\s*([^`\s]*)")
ITEM = re.compile(r"^\s*(?:[-*+]|\d+[.)])\s+")
RULE = re.compile(r"^\s*\|?[\s:|-]*-{2,}[\s:|-]*$")
LINKED = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(\s*<?([^)\s>]+)>?[^)]*\)")
STOP = re.compile(r"[.!?][)\"']*\s+(?=[\"'(`A-Z0-9])")
SHORT = re.compile(r"\b(?:e\.g|i\.e|cf|vs|Fig|Eq|approx)\.$")
IRREGULAR = (
    "built|bought|bound|broken|brought|caught|chosen|cut|dealt|done|drawn|driven|fed|felt|found|given|gone|grown|held|hidden|hit|kept|known|laid|"
    "led|left|lent|lost|made|meant|met|paid|put|read|run|said|seen|sent|set|shown|shut|sold|spent|split|spread|taken|taught|thought|thrown|told|"
    "torn|turned|understood|won|worn|wound|written|worked")
PASSIVE = re.compile(
    r"\b(?:is|are|was|were|be|been|being|gets?|got)\s+(?:(?:not|never|also|then|always|only|still|once|again|\w+ly)\s+){0,2}"
    rf"(?!(?:based|closed|needed|limited|detailed|interested|related|signed|named)\b)(?:\w+ed|{IRREGULAR})\b", re.IGNORECASE)


def shown(text):
    """What a reader sees of a line: links without targets, no pictures, no emphasis; a code span is one word."""
    text = re.sub(r"<!--.*?-->", " ", text, flags=re.S)
    text = re.sub(r"`[^`]*`", "`code`", text)
    text = LINKED.sub(lambda m: " " if m.group(1) else m.group(2), text)
    text = re.sub(r"<[^>`]+>", " ", text)
    return " ".join(re.sub(r"(?<!\w)[*_]{1,3}(?=\S)|(?<=\S)[*_]{1,3}(?!\w)", "", text).split())


def count(text):
    return sum(1 for word in shown(text).split() if re.search(r"\w", word))


def sentences(text):
    """The sentences of a text, as a reader sees them."""
    seen, begin, found = shown(text), 0, []
    for stop in STOP.finditer(seen):
        if not SHORT.search(seen[:stop.start() + 1]):
            found.append(seen[begin:stop.end()].strip())
            begin = stop.end()
    return [s for s in [*found, seen[begin:].strip()] if count(s)]


@dataclasses.dataclass
class Page:
    """A page's texts, each with the number of its first line."""
    paragraphs: list
    cells: list
    pictures: list  # (line, alternative text, target)
    bare: list      # lines of fences without a language

    @property
    def words(self):
        return sum(count(text) for _, text in self.paragraphs + self.cells)


def read(text):
    """Parses a page of Markdown. What stands between `<!-- options: ... -->` or `<!-- table: ... -->` and `<!-- end -->` is
    generated, and checked where it is generated."""
    page, lines, at, current = Page([], [], [], []), text.splitlines(), 0, None
    while at < len(lines):
        line, number = lines[at], at + 1
        at += 1
        fence = FENCE.match(line)
        if fence:
            if not fence.group(2):
                page.bare.append(number)
            while at < len(lines) and not lines[at].strip().startswith(fence.group(1)):
                at += 1
            at, current = at + 1, None
        elif line.lstrip().startswith("<!--"):
            until = "<!-- end" if re.match(r"\s*<!-- (?:options|table):", line) else "-->"
            while until not in line and at < len(lines):
                line = lines[at]
                at += 1
            current = None
        elif not line.strip() or line.startswith("#"):
            current = None
        elif line.lstrip().startswith("|"):
            current = None
            page.pictures += [(number, m.group(2), m.group(3)) for m in LINKED.finditer(line) if m.group(1)]
            if not RULE.match(line):
                row = re.sub(r"`[^`]*`", "`code`", line.strip()).replace(r"\|", "/")
                page.cells += [(number, cell) for cell in row.strip("|").split("|") if count(cell)]
        else:
            page.pictures += [(number, m.group(2), m.group(3)) for m in LINKED.finditer(line) if m.group(1)]
            if current is None or ITEM.match(line):
                current = [number, ""]
                page.paragraphs.append(current)
            current[1] += " " + re.sub(r"^\s*>+\s?", "", ITEM.sub("", line))
    page.paragraphs = [(number, text) for number, text in page.paragraphs if count(text)]
    return page


def quantile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else 0


def offences(text, history=False, most=None, pictures=0):
    """(line, sentence for the writer) of everything on a page that breaks a rule. `history` allows what belongs into changelogs;
    `most` words and at least `pictures` pictures are the page's own limits."""
    page, spoken = read(text), []
    for kind, texts in (("paragraph", page.paragraphs), ("cell", page.cells)):
        for number, body in texts:
            if count(body) > LIMITS[kind]:
                yield number, f"a {kind} of {count(body)} words; at most {LIMITS[kind]}"
            banned = WORDS if history else {**WORDS, HISTORY: "(history belongs into the changelog)"}
            for pattern, instead in banned.items():
                for hit in re.finditer(rf"(?<!\w)(?:{pattern})(?!\w)", shown(body), re.IGNORECASE):
                    yield number, f"\"{hit.group()}\"; write: {instead}"
    for number, body in page.paragraphs:
        for sentence in sentences(body):
            length, commas = count(sentence), len(re.findall(r"[,;]\s", sentence))
            spoken.append((length, bool(PASSIVE.search(sentence))))
            if length > LIMITS["sentence"]:
                yield number, f"a sentence of {length} words; at most {LIMITS['sentence']}: {sentence[:60]}..."
            if commas > LIMITS["commas"]:
                yield number, f"{commas} commas in a sentence; at most {LIMITS['commas']}: {sentence[:60]}..."
    lengths = [length for length, _ in spoken]
    if quantile(lengths, 0.5) > LIMITS["median"]:
        yield 1, f"half of the sentences have over {quantile(lengths, 0.5) - 1} words; at most {LIMITS['median']}"
    if quantile(lengths, 0.9) > LIMITS["ninetieth"]:
        yield 1, f"one sentence in ten has over {quantile(lengths, 0.9) - 1} words; at most {LIMITS['ninetieth']}"
    passive = round(100 * sum(p for _, p in spoken) / len(spoken)) if spoken else 0
    if len(spoken) >= 10 and passive > LIMITS["passive"]:
        yield 1, f"{passive} % of the sentences are passive; at most {LIMITS['passive']} %"
    for number in page.bare:
        yield number, "a block of code without a language"
    for number, alternative, target in page.pictures:
        if count(alternative) < LIMITS["alternative"]:
            yield number, f"{target}: the alternative text has under {LIMITS['alternative']} words"
    if len(page.pictures) < pictures:
        yield 1, f"{len(page.pictures)} pictures; at least {pictures}"
    if most is not None and page.words > most:
        yield 1, f"{page.words} words; at most {most}"
