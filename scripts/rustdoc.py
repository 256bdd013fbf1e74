#!/usr/bin/env python3
"""Documents the crates with rustdoc and fails on every warning: broken links, links to private items, bad code blocks.

    python scripts/rustdoc.py [ARGUMENT...]      `cargo doc --workspace --no-deps` with these arguments, such as --release --locked
    python scripts/rustdoc.py --self-test        asserts which warnings are findings

Comments give units in brackets, `[m]`, which rustdoc takes for links to items of such names. Cargo.toml therefore turns its lint
for broken links off; here the lint is on, and only units pass. The pages are in target/doc.

Needs Python 3.8 or later and cargo, or the program that CARGO names. Exit codes: 0 no finding; 1 findings, or the build failed.
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# Units that comments give in brackets, where rustdoc could take them for the name of an item.
UNITS = {"m", "mm", "um", "px", "rad", "deg", "degree", "degrees", "s", "ms", "us", "minutes", "Hz", "N", "Nm", "kg", "bytes",
         "MiB", "cells", "voxels"}
BROKEN_LINK = "rustdoc::broken_intra_doc_links"
UNRESOLVED = re.compile(r"unresolved link to `(\w+)`$")


def is_finding(message):
    """Whether a compiler message is a warning or an error that is to be fixed."""
    if message["level"] not in ("warning", "error") or not message["spans"]:
        return False
    code = (message.get("code") or {}).get("code")
    unit = UNRESOLVED.match(message["message"])
    return not (code == BROKEN_LINK and unit and unit.group(1) in UNITS)


def self_test():
    """Asserts which messages are findings."""
    def message(text, code=BROKEN_LINK, level="warning", spans=1):
        return {"message": text, "code": code and {"code": code}, "level": level, "spans": [{}] * spans}

    assert is_finding(message("unresolved link to `PairTracker`"))
    assert is_finding(message("unresolved link to `m::forget`"))
    assert is_finding(message("unclosed HTML tag `path`", "rustdoc::invalid_html_tags"))
    assert is_finding(message("unresolved link to `m`", "rustdoc::private_intra_doc_links"))
    assert not is_finding(message("unresolved link to `m`"))
    assert not is_finding(message("4 warnings emitted", None, spans=0))
    assert not is_finding(message("a note", level="note"))


def clippy_variables():
    """Variables with which `cargo clippy -- -D warnings` calls the compiler: Cargo then reuses what clippy has checked.

    Rustdoc needs the checked crates below each crate. Checked by the compiler alone they would be checked a second time.
    """
    sysroot = subprocess.run(["rustc", "--print", "sysroot"], cwd=ROOT, stdout=subprocess.PIPE, text=True).stdout.strip()
    driver = Path(sysroot).resolve() / "bin" / "clippy-driver"
    if not driver.is_file():
        return {}
    separator = "__CLIPPY_HACKERY__"
    return {"RUSTC_WORKSPACE_WRAPPER": str(driver), "CLIPPY_ARGS": f"-D{separator}warnings{separator}"}


def document(arguments):
    """Runs cargo doc; returns its exit code and the findings, as `file:line: message`."""
    flags = f"{os.environ.get('RUSTDOCFLAGS', '')} -Wrustdoc::broken-intra-doc-links".strip()
    environment = {**os.environ, **clippy_variables(), "RUSTDOCFLAGS": flags}
    command = [os.environ.get("CARGO", "cargo"), "doc", "--workspace", "--no-deps", "--message-format=json", *arguments]
    run = subprocess.run(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True)
    findings = []
    for line in run.stdout.splitlines():
        message = json.loads(line).get("message")
        if isinstance(message, dict) and is_finding(message):
            span = next((span for span in message["spans"] if span["is_primary"]), message["spans"][0])
            findings.append(f"{span['file_name']}:{span['line_start']}: {message['message']}")
    return run.returncode, findings


def main():
    arguments = sys.argv[1:]
    if arguments == ["--self-test"]:
        self_test()
        return 0
    code, findings = document(arguments)
    for finding in findings:
        print(finding)
    if findings:
        print(f"rustdoc: {len(findings)} findings", file=sys.stderr)
    return 1 if findings or code else 0


if __name__ == "__main__":
    sys.exit(main())
