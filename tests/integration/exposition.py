"""Reads the text format of Prometheus (0.0.4) and refuses what is not it."""

import math
import re

NAME = r"[a-zA-Z_:][a-zA-Z0-9_:]*"
LABEL = r'[a-zA-Z_][a-zA-Z0-9_]*="(?:[^"\\\n]|\\[\\"n])*"'
SAMPLE = re.compile(rf"({NAME})(?:\{{({LABEL}(?:,{LABEL})*)\}})? (\S+)")
SUFFIXES = {"histogram": ("_bucket", "_sum", "_count"), "counter": ("",), "gauge": ("",)}


def number(text):
    if text in ("+Inf", "-Inf", "Nan"):
        return float(text)
    assert re.fullmatch(r"-?\d+(\.\d+)?(e[+-]?\d+)?", text), text
    return float(text)


def labels_of(text):
    return tuple(sorted(re.findall(r'([a-zA-Z_][a-zA-Z0-9_]*)="((?:[^"\\\n]|\\[\\"n])*)"', text or "")))


def family_of(name, types):
    for family, kind in types.items():
        if name.startswith(family) and name[len(family):] in SUFFIXES[kind]:
            return family
    raise AssertionError(f"{name} belongs to no family before it")


def check_histogram(family, samples):
    buckets = [(number(dict(labels)["le"]), value) for (name, labels), value in samples.items()
               if name == family + "_bucket"]
    bounds, counts = zip(*buckets)
    assert list(bounds) == sorted(set(bounds)) and bounds[-1] == math.inf
    assert list(counts) == sorted(counts)
    assert counts[-1] == samples[family + "_count", ()]


def read(text):
    """Samples by (name, labels), types by family."""
    assert text.endswith("\n")
    samples, types, helped, current = {}, {}, set(), None
    for line in text.splitlines():
        if line.startswith("# HELP "):
            name, words = line[7:].split(" ", 1)
            assert re.fullmatch(NAME, name) and words and name not in helped
            helped.add(name)
        elif line.startswith("# TYPE "):
            current, kind = line[7:].split(" ")
            assert current in helped and current not in types, "each family once, in one piece"
            types[current] = kind
            assert (kind == "counter") == current.endswith("_total")
        else:
            match = SAMPLE.fullmatch(line)
            assert match, line
            key = match[1], labels_of(match[2])
            assert family_of(match[1], {current: types[current]}) == current
            assert key not in samples, f"{key} comes twice"
            samples[key] = number(match[3])
    for family, kind in types.items():
        if kind == "histogram":
            check_histogram(family, samples)
    return samples, types
