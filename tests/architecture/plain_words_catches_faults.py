#!/usr/bin/env python3
"""The check of plain words must be able to fail: each fault in a small tree must be named, and nothing else."""

import contextlib
import io
import pathlib
import sys
import tempfile

import plain_words

LONG = "This sentence has " + "very " * 30 + "many words."
PLAIN = "The solver starts from the previous answer."
# Name of a file, its text, the limit that it exceeds; none: it is plain.
CASES = (
    ("a.md", PLAIN, None),
    ("a.md", LONG, "over 30 words"),
    ("a.md", "Of closed sessions the server keeps nothing.", "fronted"),
    ("a.md", "The reply says what is wrong with it.", "clauses"),
    ("a.md", f"{PLAIN}\n\n```\nOf code nothing is counted, as you can see.\n```\n", None),
    ("a.h", f"// {PLAIN}\nint of = 1;  // Where it is closed the server keeps it.\n", "fronted"),
    ("a.proto", "// This one is for who runs a server at home.\n", "clauses"),
    ("a.cpp", 'const char* text = "Of code nothing is counted, as you can see.";\n', None),
    ("a.py", f'"""{LONG}"""\n', "over 30 words"),
    ("a.py", f'# {PLAIN}\ntext = "What is it that nobody reads in here?"\n', None),
    ("a_pb2.py", f'"""{LONG}"""\n', None),
)


def main() -> int:
    is_failed = False
    for name, text, fault in CASES:
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "docs").mkdir()
            (root / "docs" / name).write_text(text, encoding="utf-8")
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                found = plain_words.main(root, ("docs",))
        is_right = found == (fault is not None) and (fault is None or f"  {fault} beyond" in printed.getvalue())
        if not is_right:
            print(f"{name}: {text!r} must be {fault or 'plain'}, but:\n{printed.getvalue()}")
        is_failed = is_failed or not is_right
    return is_failed


if __name__ == "__main__":
    sys.exit(main())
