#!/usr/bin/env python3
"""Checks the language of comments, messages and documents: four rules that a program can check.

    python scripts/language.py               the whole repository; prints `file:line: rule: text` per finding
    python scripts/language.py --counts      lines of documentation, and how many of them begin with an opening word
    python scripts/language.py --frequencies [FOLDER]   words per 1,000 of documents, comments and messages, here or in a folder
    python scripts/language.py --self-test   asserts what the rules find and what they pass

opening: a doc comment, a docstring or a paragraph of a document names its subject. It begins with none of Of, Those, What,
         Who, How, The same, That, As, One that, Its, It, They; a further line of a Rust doc comment with none of the first
         eight.
per:     rates use "per": samples per shard, not "samples a shard".
word:    documents, messages and help strings use the field's words: rotation, not turn; index, position or pose, not place;
         evaluate or check, not look at; largest or smallest count, not most or least; "expressed in" a frame, not "seen
         from"; compared with, not held against; "stated" or "distinguished", not told.
budget:  documents, documentation comments and messages use each word of our old idiom (stand, say, ask, "so many", nobody, mend)
         at most 0.2 times per 1,000 words, as the documentation of other projects does. The finding names the files with most.

Needs Python 3.8 or later and git. Exit codes: 0 nothing found; 1 findings; 2 wrong arguments.
"""

import argparse
import ast
import io
import os
import re
import subprocess
import sys
import tokenize
from pathlib import Path

# Programs are found only in absolute folders of PATH: the current folder contains data.
os.environ["PATH"] = os.pathsep.join(filter(os.path.isabs, os.environ.get("PATH", "").split(os.pathsep)))

ROOT = Path(__file__).resolve().parent.parent
PATTERNS = ("src/*.rs", "tests/*.rs", "benches/*.rs", "fuzz/*.rs", "python/*.py", "README.md", "docs/*.md",
            "CONTRIBUTING.md", "SECURITY.md", "src/*.md", "examples/*.rs", ".github/*.md",
            "ARCHITECTURE.md", "CHANGELOG.md")

# Rule `opening`. A capital begins a sentence, so continued lines of a sentence pass.
LINE_OPENING = re.compile(r"(Of|As|Those|The same|What|Who|How|That)\b")
FIRST_OPENING = re.compile(r"(Of|As|Those|The same|What|Who|How|That|One that|Its|It|They)\b")

# Rule `per`: a counted noun, "a", and what it is counted per. Nouns are listed, since verbs end in s, too.
COUNTED = (
    r"\d+(?:,\d{3})*(?:\.\d+)?|ones?|once|twice|two|three|four|ten|values?|rows?|labels?|cells?|bytes?|pixels|subpixels|edges|bits?|numbers?"
    r"|metres|millimetres|micrometres|radians|degrees|lines?|torque|force|us|ms|milliseconds|microseconds|seconds|minutes"
    r"|hours|samples|steps|messages?|jobs|indices|leaf|leaves|points|starts|[kKMG]i?B|time|chunk|objects|rays|triangles"
    r"|poses|trials|grasps|probes|images|orientations|views|threads|tasks"
)
UNIT = (
    r"second|minute|hour|day|shard|view|sample|object|line|step|thread|row|file|run|pose|position|pixel|cell|unit|joint"
    r"|driven joint|image|class|task|topic|channel|byte|block|chunk|core|machine|hand|contact|trial|grasp|kept grasp|job"
    r"|mesh|subject|orientation|direction|axis|side|ray|triangle|point|vertex|metre|degree|radian|query|band|type|pair"
    r"|lane|level|process"
)
RATE = re.compile(rf"\b(?:{COUNTED}) an? (?:{UNIT})\b(?! of it\b)", re.IGNORECASE)
# A noun before the subject of a sub-clause, or a verb that is also a noun.
NO_RATE = re.compile(
    r"(which|how many [\w ]*) (cells|points|poses|steps) an? |\b(points|cells) an? \w+ (is|has|can|or)\b"
    r"|\b(labels|views|steps|times|tasks|numbers?|threads|probes|objects|images) an? \w+('s|,| (is|has|that|whose|of|in|by|for|to|with))\b"
    r"|poses a point for each",
    re.IGNORECASE,
)

# Rule `word`: what is found, and what passes all the same.
WORDS = (
    (re.compile(r"\btold\b", re.IGNORECASE), None),
    (re.compile(r"\bturn(s|ed|ing)?\b", re.IGNORECASE),
     re.compile(r"\bin turn\b|\bturn(s|ed|ing)? (\S+ ){0,8}(in)?to\b|\bturn(s|ed|ing)? (on|off|out)\b", re.IGNORECASE)),
    (re.compile(r"\blook(s|ed|ing)? at\b", re.IGNORECASE), None),
    (re.compile(r"\bplaces?\b", re.IGNORECASE),
     re.compile(r"\bin (its |their |the )?place\b|\b(takes?|taking|taken|took) (the )?place\b|\bdecimal places?\b",
                re.IGNORECASE)),
    (re.compile(r"\b[Ll]east\b"),
     re.compile(r"\b([Aa]t|not) least\b|\b[Ll]east (squares|significant)\b|\bleast of all\b")),
    (re.compile(r"\b[Mm]ost (tasks|samples|views|runs|steps|trials|pairs|points|objects|grasps|time|bytes|threads)\b"),
     re.compile(r"\b[Aa]t most \w+")),
    (re.compile(r"\bseen from\b", re.IGNORECASE),
     re.compile(r"\bseen from (above|below|outside|inside|behind|\d+ \w+|\w+ (side|direction|view)s?|the (front|side|camera|robot's right))"
                r"(?!\w)",
                re.IGNORECASE)),
    (re.compile(r"\bheld against\b", re.IGNORECASE), None),
)
# Doc comments that users read: help of the command line, and keys of the job file.
USERS_READ = re.compile(r"src/cli/args\.rs$|/spec\w*\.rs$|/spec/")
# Texts that no user reads: why a lint is lifted, what cannot happen.
FOR_PROGRAMMERS = re.compile(r"reason = $|\.expect\($|assert\w*!\(|unreachable!\(")
NAMES = {"graspmill place"}
TEST_FILE = re.compile(r"^(tests|benches|fuzz)/|tests?\.rs$|/tests/|^python/tests/")


def opening(text, first):
    """Findings of the rule `opening` in a line of documentation."""
    found = (FIRST_OPENING if first else LINE_OPENING).match(text)
    return [("opening", text)] if found else []


def rates(text):
    """Findings of the rule `per` in a line of a comment or a document."""
    passed = [span.span() for span in NO_RATE.finditer(text)]
    found = (match for match in RATE.finditer(text) if not any(a < match.end() and match.start() < b for a, b in passed))
    return [("per", match.group(0)) for match in found]


def words(text, before=""):
    """Findings of the rule `word` in a text for users, after the text before it; code in backquotes and placeholders pass."""
    text = before + text
    text = re.sub(r"`[^`]*`|\{[^{}]*\}", lambda code: "_" * len(code.group(0)), text)
    findings = []
    for found, passes in WORDS:
        passed = [span.span() for span in passes.finditer(text)] if passes else []
        for match in found.finditer(text):
            known = any(a <= match.start() and match.end() <= b for a, b in passed)
            if match.start() >= len(before) and not known:
                findings.append(("word", text[max(0, match.start() - 30):match.end() + 30].strip()))
    return findings


def rust_strings(text):
    """The texts of a Rust file, as (line, content), before its module of tests; those for programmers alone are left out."""
    end = re.search(r"^#\[cfg\(test\)\]\nmod \w+ \{", text, re.MULTILINE)
    text = text[:end.start()] if end else text
    token = re.compile(
        r"//[^\n]*|/\*.*?\*/|b?r(#*)\"(?P<raw>.*?)\"\1|b?\"(?P<plain>(?:[^\"\\]|\\.)*)\"|'(?:[^'\\\n]|\\[^\n]{1,8}?)'",
        re.DOTALL,
    )
    for match in token.finditer(text):
        content = match.group("raw") if match.group("raw") is not None else match.group("plain")
        line = text[text.rfind("\n", 0, match.start()) + 1:match.start()]
        if content is not None and not FOR_PROGRAMMERS.search(line):
            yield text.count("\n", 0, match.start()) + 1, content


def rust(path, text):
    """Findings in a Rust file, as (line, rule, text)."""
    before = None
    for number, line in enumerate(text.split("\n"), 1):
        doc = re.match(r"\s*//([/!])(?: |$)(.*)", line)
        if doc:
            first = before != doc.group(1)
            for finding in opening(doc.group(2), first):
                yield (number, *finding)
            if USERS_READ.search(path):
                for finding in words(doc.group(2)):
                    yield (number, *finding)
        before = doc.group(1) if doc else None
        comment = re.match(r"(?:.*\s)?//[/!]?( .*)", line)
        for finding in rates(comment.group(1)) if comment else ():
            yield (number, *finding)
    if not TEST_FILE.search(path):
        for number, content in rust_strings(text):
            # A text without a space is a name, and so is one inside a simulation.
            for finding in words(content) if " " in content.strip() and content not in NAMES else ():
                yield (number, *finding)


def python(path, text):
    """Findings in a Python file, as (line, rule, text)."""
    for node in ast.walk(ast.parse(text)):
        body = getattr(node, "body", None)
        documented = isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef))
        docstring = ast.get_docstring(node, clean=True) if documented else None
        if docstring is not None:
            start = body[0].lineno
            for offset, line in enumerate(docstring.split("\n")):
                for finding in (opening(line, True) if offset == 0 else []) + rates(line):
                    yield (start + offset, *finding)
        if isinstance(node, ast.Raise) and not TEST_FILE.search(path):
            for part in ast.walk(node):
                if isinstance(part, ast.Constant) and isinstance(part.value, str):
                    for finding in words(part.value):
                        yield (part.lineno, *finding)
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            for finding in rates(token.string):
                yield (token.start[0], *finding)


def markdown(_path, text):
    """Findings in a document, as (line, rule, text)."""
    fenced, before = False, ""
    for number, line in enumerate(text.split("\n"), 1):
        if line.lstrip().startswith("```"):
            fenced, before = not fenced, ""
            continue
        if not fenced:
            last = before.split()[-1] + " " if before.strip() else ""
            for finding in (opening(line, True) if not before.strip() else []) + words(line.lstrip(), last):
                yield (number, *finding)
        for finding in rates(line):
            yield (number, *finding)
        before = line


# Rule `budget`: how often each group may occur per 1,000 words of a kind of text.
BUDGET = 0.2
IDIOM = {
    "stand": r"stand(?:s|ing)?|stood",
    "say": r"say(?:s|ing)?|said",
    "ask": r"ask(?:s|ed|ing)?",
    "so many": r"so (?:many|much)",
    "nobody": r"nobody",
    "mend": r"mend(?:s|ed|ing)?",
}
# Words that documentation of the field uses often; `--frequencies` prints them for comparison.
COMMON = {
    "use": r"use[sd]?|using",
    "default": r"defaults?",
    "must": r"must|should",
    "return": r"return(?:s|ed)?",
}
GROUPS = {name: re.compile(rf"\b(?:{words})\b", re.IGNORECASE) for name, words in {**IDIOM, **COMMON}.items()}
WORD = re.compile(r"[A-Za-z][A-Za-z'-]*")


def texts(name, text):
    """The texts of a file, as (kind, text); code in backquotes and placeholders are left out."""
    if name.endswith(".md"):
        parts = re.split(r"^\s*```.*$", text, flags=re.MULTILINE)
        found = [("documents", part) for part in parts[::2]]
    elif name.endswith(".py"):
        nodes = (node for node in ast.walk(ast.parse(text))
                 if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)))
        found = [("comments", ast.get_docstring(node) or "") for node in nodes]
    else:
        lines = (re.match(r"\s*//[/!](?: |$)(.*)", line) for line in text.split("\n"))
        found = [("comments", line.group(1)) for line in lines if line]
        if not TEST_FILE.search(name):
            found += [("messages", content) for _, content in rust_strings(text) if " " in content.strip()]
    return [(kind, re.sub(r"`[^`]*`|\{[^{}]*\}", "_", part)) for kind, part in found]


def frequencies(files):
    """Words and occurrences of each group, by kind of text, and occurrences by group and file, of (name, text) pairs."""
    words, count, places = {}, {}, {}
    for name, text in files:
        for kind, part in texts(name, text):
            words[kind] = words.get(kind, 0) + len(WORD.findall(part))
            for group, pattern in GROUPS.items():
                found = len(pattern.findall(part))
                count[kind, group] = count.get((kind, group), 0) + found
                if found:
                    places.setdefault((kind, group), {}).setdefault(name, 0)
                    places[kind, group][name] += found
    return words, count, places


def over_budget(files):
    """Findings of the rule `budget`, as texts."""
    words, count, places = frequencies(files)
    findings = []
    for (kind, group), found in sorted(count.items()):
        rate = 1000 * found / max(1, words[kind])
        if group in IDIOM and rate > BUDGET:
            most = sorted(places[kind, group].items(), key=lambda place: (-place[1], place[0]))[:5]
            named = ", ".join(f"{name} ({times})" for name, times in most)
            findings.append(f"{kind}: budget: '{group}' occurs {rate:.2f} times per 1,000 words, at most {BUDGET}: {named}")
    return findings


def print_frequencies(folder):
    """Prints occurrences per 1,000 words of each group, by kind of text; of a folder other than the repository, of all its files."""
    if folder is None:
        files = [(name, read(name)) for name in sources()]
    else:
        paths = [path for path in sorted(Path(folder).rglob("*")) if path.suffix in READERS and path.is_file()]
        files = []
        for path in paths:
            text = path.read_text(encoding="utf-8", errors="replace")
            try:
                texts(path.name, text)
            except SyntaxError:
                continue
            files.append((path.relative_to(folder).as_posix(), text))
    words, count, _ = frequencies(files)
    for kind, total in sorted(words.items()):
        rates_found = ", ".join(f"{group} {1000 * count[kind, group] / max(1, total):.2f}" for group in GROUPS)
        print(f"{kind}: {total} words; per 1,000: {rates_found}")


READERS = {".rs": rust, ".py": python, ".md": markdown}


def sources():
    """The files that the rules are for, as git lists them."""
    listed = subprocess.run(["git", "ls-files", "-z", *PATTERNS], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return [name for name in listed.split("\0") if name]


def read(name):
    """The text of a file, or none when it is listed but gone."""
    path = ROOT / name
    return path.read_text(encoding="utf-8") if path.is_file() else ""


def counts():
    """Lines of Rust documentation, and those of them that begin with a word of the rule `opening`."""
    lines = [re.match(r"\s*//[/!] ?(.*)", line) for name in sources() if name.endswith(".rs") for line in read(name).split("\n")]
    documentation = [line.group(1) for line in lines if line]
    return len(documentation), sum(1 for line in documentation if LINE_OPENING.match(line))


def self_test():
    """Asserts that the rules find what they must and pass what they should."""
    def found(reader, name, text):
        return sorted({rule for _, rule, _ in reader(name, text)})

    bad = (
        (rust, "src/a.rs", "/// Of the object.\npub a: u32,", "opening"),
        (rust, "src/a.rs", "/// Its name.\npub a: u32,", "opening"),
        (rust, "src/a.rs", "//! What is known.", "opening"),
        (rust, "src/a.rs", "/// Runs per object.\n/// Those of annealing start anew.", "opening"),
        (python, "python/a.py", '"""How it works."""', "opening"),
        (markdown, "docs/a.md", "# A\n\nThe same holds.", "opening"),
        (rust, "src/a.rs", "// Takes 20 us a step.", "per"),
        (rust, "src/a.rs", "x(); // two values a driven joint", "per"),
        (python, "python/a.py", "# one row a grasp", "per"),
        (markdown, "docs/a.md", "It makes 350 samples a second.", "per"),
        (rust, "src/a.rs", 'fail("the hand was told to stop");', "word"),
        (rust, "src/a.rs", 'fail("no such place {at}");', "word"),
        (rust, "src/cli/args.rs", "/// Random postures to look at.", "word"),
        (rust, "src/factory/a/spec.rs", "/// Cells in a full turn.", "word"),
        (python, "python/a.py", 'raise ValueError("least share of cells")', "word"),
        (markdown, "docs/a.md", "A frame seen from the palm.", "word"),
        (markdown, "docs/a.md", "Files are held against their digests.", "word"),
        (markdown, "docs/a.md", "Most samples a task makes.", "word"),
    )
    for reader, name, text, rule in bad:
        assert rule in found(reader, name, text), (rule, text)
    good = (
        (rust, "src/a.rs", "/// Mass of the object [kg].\n/// of which it is made.\n/// Itself it holds nothing.\npub a: f64,"),
        (rust, "src/a.rs", "/// Asset table.\npub a: u32,"),
        (rust, "src/a.rs", "// One value per joint. A shard is a run of samples; it reads a file and holds a row."),
        (rust, "src/a.rs", 'call("place", "told", "at least one view, at most steps", "grasps.turn");'),
        (rust, "src/a.rs", 'found.expect("it has a place"); const NAME: &str = "graspmill_place";'),
        (rust, "src/a.rs", 'fail("{place}: `turn` must be a number");'),
        (rust, "src/a.rs", "#[cfg(test)]\nmod tests {\n    fn a() { fail(\"its place is wrong\"); }\n}"),
        (rust, "tests/a.rs", 'fail("its place is wrong");'),
        (python, "python/a.py", '"""A reader.\n\nHow it works: not at all."""'),
        (markdown, "docs/a.md", "# How it works\n\nThe job takes a view.\nWhat follows is code:\n\n```\nIt turns.\n```"),
        (markdown, "docs/a.md", "Rolls are taken in turn, in place of a list; at least one, seen from 12 sides."),
        (markdown, "docs/a.md", "A list stands in\nplace of the number; it has at\nleast one entry."),
        (markdown, "docs/a.md", "graspmill turns a job file into a dataset by damped least squares."),
    )
    for reader, name, text in good:
        assert not found(reader, name, text), (list(reader(name, text)), text)
    plain = "word " * 4998
    assert over_budget([("docs/a.md", plain + "It stands. They stood.")]), "two of 5,000 are more than one"
    assert not over_budget([("docs/a.md", plain + "It stands.\n```\nstands stands\n```\n`stands`")])
    assert over_budget([("src/a.rs", 'fail("nobody said so")')])
    assert not over_budget([("tests/a.rs", 'fail("nobody said so")')])


def main():
    parser = argparse.ArgumentParser(description="Checks the language of comments, messages and documents.")
    parser.add_argument("--counts", action="store_true", help="print lines of documentation and their opening words")
    parser.add_argument("--frequencies", nargs="?", const="", metavar="FOLDER",
                        help="print words per 1,000, of this repository or of a folder")
    parser.add_argument("--self-test", action="store_true", help="assert what the rules find and what they pass")
    arguments = parser.parse_args()
    if arguments.frequencies is not None:
        print_frequencies(arguments.frequencies or None)
        return 0
    if arguments.self_test:
        self_test()
        return 0
    if arguments.counts:
        lines, bad = counts()
        print(f"{bad} of {lines} lines of Rust documentation ({100 * bad / max(1, lines):.1f} %) begin with an opening word")
        return 0
    findings = 0
    for name in sources():
        for number, rule, text in sorted(READERS[Path(name).suffix](name, read(name))):
            print(f"{name}:{number}: {rule}: {text.strip()[:120]}")
            findings += 1
    for finding in over_budget((name, read(name)) for name in sources()):
        print(finding)
        findings += 1
    if findings:
        print(f"language: {findings} findings; see the rules in scripts/language.py", file=sys.stderr)
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
