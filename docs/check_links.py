#!/usr/bin/env python3
"""Checks that every relative link of the documents resolves, anchors included, and that README.md is short.

    python3 docs/check_links.py
"""

import os
import re
import subprocess
import sys

README_MAX_LINES = 120


def without_code(text):
    return re.sub(r"```.*?```", "", text, flags=re.DOTALL)


def anchors(text):
    """The anchors that GitHub makes of the headings."""
    for heading in re.findall(r"^#+ (.*)$", without_code(text), re.MULTILINE):
        heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        yield re.sub(r"[^\w\- ]", "", re.sub(r"[`*]", "", heading.strip()).lower()).replace(" ", "-")


def broken_links(file, text):
    for link in re.findall(r"\]\(([^)]+)\)", without_code(text)):
        link = re.sub(r"\s+", "", link)
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = os.path.normpath(os.path.join(os.path.dirname(file), path)) if path else file
        if not os.path.exists(target):
            yield f"{file}: {link}: no such file"
        elif anchor and anchor not in anchors(open(target, encoding="utf-8").read()):
            yield f"{file}: {link}: no such heading"


def main():
    os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
    files = subprocess.run(["git", "ls-files", "*.md"], capture_output=True, text=True, check=True).stdout.split()
    problems = [problem for file in files for problem in broken_links(file, open(file, encoding="utf-8").read())]
    lines = len(open("README.md", encoding="utf-8").read().splitlines())
    if lines > README_MAX_LINES:
        problems.append(f"README.md: {lines} lines, and at most {README_MAX_LINES} are wanted")
    print("\n".join(problems) or f"{len(files)} files: every link resolves; README.md has {lines} lines")
    sys.exit(bool(problems))


if __name__ == "__main__":
    main()
