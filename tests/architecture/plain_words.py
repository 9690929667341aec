#!/usr/bin/env python3
"""Measures how plain the docs, comments and docstrings are. Exit code 1 and the worst sentences if a folder exceeds a limit.

usage: plain_words.py ROOT [FOLDER ...]    a sentence has at least 6 words; code, tables and headings do not count
"""

import pathlib
import re
import sys

FOLDERS = ("docs", "engine", "server", "proto", "clients", "bench", "examples", ".")
ENDS = (".md", ".h", ".cpp", ".proto", ".py", ".ts", ".mjs")
LEFT_OUT = ("docs/report/", "/node_modules/", "/dist/", "/gen/", "_pb2.py", "clients/python/build/")
# Mean words of a sentence, and shares of sentences over 30 words and of the two patterns below.
LIMITS = {"mean words": 18, "over 30 words": 0.05, "fronted": 0.01, "clauses": 0.01}
FRONTED = re.compile(r"^(?:\*\*)?(?:Of|Where|What|Who|Whoever|Nor|Such|So)\b")
CLAUSE = re.compile(
    r"\b(?:what (?:is|was|has|it|they|that|comes|came|holds|others|one|nobody)"
    r"|who (?:runs|reads|is|has|may|watches|asks|waits|does|only|made)|whoever|nobody|others than)\b", re.IGNORECASE)
TAG = re.compile(r"^@(?:param|returns?|throws|pre|tparam)\b")


def of_lines(text: str, marks: str) -> str:
    """Comments to the end of a line; code between two of them parts their sentences."""
    found = (re.search(rf"(?:{marks})\s?(.*)$", line) for line in text.splitlines())
    return "\n".join(("\n" if TAG.match(one[1]) else "") + re.sub(r"^@\w+(?: \w+)?", "", one[1]) if one else "\n" for one in found)


def prose(name: str, text: str) -> str:
    if name.endswith(".py"):
        text = of_lines(text, r"#:?") + "\n\n" + "\n\n".join(re.findall(r'"""(.*?)"""', text, re.DOTALL))
    elif not name.endswith(".md"):
        text = of_lines(text, r"//[/!]?<?") + "\n\n" + "\n\n".join(re.findall(r"/\*+(.*?)\*/", text, re.DOTALL))
    text = re.sub(r"```.*?```", "\n\n", text, flags=re.DOTALL)
    return re.sub(r"(?m)^(?: {4}.*|#.*|\|.*)$", "", text)


def sentences(name: str, text: str) -> "list[str]":
    blocks = re.split(r"\n\s*\n|\n(?=\s*[-*] |\s*\d+\. )", prose(name, text))
    every = (one.lstrip("-* ") for block in blocks for one in re.split(r"(?<=[.!?])\s+(?=[A-Z`*\[])", " ".join(block.split())))
    return [one for one in every if len(one.split()) >= 6]


def faults_of(sentence: str) -> "set[str]":
    checks = {"over 30 words": len(sentence.split()) > 30, "fronted": FRONTED.search(sentence), "clauses": CLAUSE.search(sentence)}
    return {name for name, is_fault in checks.items() if is_fault}


def measures(found: "list[str]") -> "dict[str, float]":
    values = {"mean words": sum(len(one.split()) for one in found) / len(found)}
    for name in ("over 30 words", "fronted", "clauses"):
        values[name] = sum(name in faults_of(one) for one in found) / len(found)
    return values


def files_of(root: pathlib.Path, folder: str) -> "list[pathlib.Path]":
    found = root.glob("*.md") if folder == "." else (root / folder).rglob("*")
    return sorted(one for one in found if one.name.endswith(ENDS) and not any(part in one.as_posix() for part in LEFT_OUT))


def main(root: pathlib.Path, folders: "tuple[str, ...]") -> int:
    is_failed = False
    for folder in folders:
        found = [(path, one) for path in files_of(root, folder) for one in sentences(path.name, path.read_text(encoding="utf-8"))]
        if not found:
            continue
        values = measures([one for _, one in found])
        print(f"{folder:10} {len(found):6} sentences   " + "   ".join(f"{name} {value:.3g}" for name, value in values.items()))
        for name in [name for name, value in values.items() if value > LIMITS[name]]:
            is_failed = True
            worst = [(path, one) for path, one in found if name in faults_of(one) or name == "mean words"]
            for path, one in sorted(worst, key=lambda pair: -len(pair[1]))[:10]:
                print(f"  {name} beyond {LIMITS[name]:g}: {path.relative_to(root)}: {one[:160]}")
    return is_failed


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1]), tuple(sys.argv[2:]) or FOLDERS))
