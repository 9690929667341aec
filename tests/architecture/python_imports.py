#!/usr/bin/env python3
"""Checks who imports whom in the Python client against CONTRIBUTING.md. Exit code 1 and one line per fault."""

import ast
import pathlib
import re
import sys

PACKAGE = "clients/python/limber"
KINDS = ("bodies", "linkages", "beams")
# The only modules that know kinds: the package, which has the public names, and the registry, which servers are made of.
KNOW_KINDS = {"limber", "limber.kinds"}
# What is made of the kinds: a kind may name it in annotations only.
MADE_OF_KINDS = {"limber", "limber.kinds", "limber.server", "limber.launching"}
REGISTRY_USERS = {"limber", "limber.server"}
# Which kind a scene is of: asked by nobody but the kind itself.
BRANCH_ON_KIND = re.compile(r"""HasField\(["'](linkage|beams)["']\)""")
FIELD_OF_KIND = {"linkages": "linkage", "beams": "beams"}


def name_of(path: str) -> str:
    """limber.beams.edits of clients/python/limber/beams/edits.py; of a package's __init__.py the package."""
    return path.removeprefix("clients/python/").removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def kind_of(module: str) -> str:
    """The kind whose folder a module is in; empty: it is of all kinds."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 and parts[1] in KINDS else ""


def is_typing_only(node: ast.stmt) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


class Imports(ast.NodeVisitor):
    """Modules of the client that a module imports: all of them, those that run, and those that run when it is loaded."""

    def __init__(self, path: str, modules: "set[str]"):
        module = name_of(path)
        self.package = module if path.endswith("/__init__.py") else module.rpartition(".")[0]
        self.modules = modules
        self.every: "set[str]" = set()
        self.running: "set[str]" = set()
        self.loading: "set[str]" = set()
        self._typing = self._later = 0

    def visit_If(self, node: ast.If) -> None:
        typing = is_typing_only(node)
        self._typing += typing
        for child in node.body:
            self.visit(child)
        self._typing -= typing
        for child in node.orelse:
            self.visit(child)

    def visit_FunctionDef(self, node: ast.AST) -> None:
        self._later += 1
        self.generic_visit(node)
        self._later -= 1

    visit_AsyncFunctionDef = visit_FunctionDef

    def visit_Import(self, node: ast.Import) -> None:
        for alias in node.names:
            self._note(alias.name)

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None:
        folder = self.package.split(".")
        base = ".".join([*(folder[:len(folder) - node.level + 1] if node.level else []),
                         *([node.module] if node.module else [])])
        for alias in node.names:
            inner = f"{base}.{alias.name}"
            self._note(inner if inner in self.modules else base)

    def _note(self, module: str) -> None:
        if module.split(".")[0] != "limber" or module.startswith("limber.v1"):
            return
        self.every.add(module)
        if not self._typing:
            self.running.add(module)
            if not self._later:
                self.loading.add(module)


def faults_of(path: str, imports: Imports, text: str) -> "list[str]":
    module = name_of(path)
    own = kind_of(module)
    faults = [f"{path}: asks for a kind: {found[0]}" for found in BRANCH_ON_KIND.finditer(text)
              if FIELD_OF_KIND.get(own) != found[1]]
    for other in sorted(imports.every):
        kind = kind_of(other)
        if own and kind and kind != own:
            faults.append(f"{path}: {own} must not import {other}")
        if not own and kind and module not in KNOW_KINDS:
            faults.append(f"{path}: what all kinds share must not import {other}")
        if other == "limber.kinds" and module not in REGISTRY_USERS:
            faults.append(f"{path}: the registry is for limber.server alone")
    if own:
        faults += [f"{path}: {own} must not import {other}, which is made of kinds"
                   for other in sorted(imports.running & MADE_OF_KINDS)]
    return faults


def cycles(graph: "dict[str, set[str]]") -> "list[str]":
    """Modules that need each other to be loaded, directly or round about."""
    faults = []
    for start in sorted(graph):
        reached, waiting = set(), [start]
        while waiting:
            fresh = graph.get(waiting.pop(), set()) - reached
            reached |= fresh
            waiting += fresh
        if start in reached:
            faults.append(f"import cycle through {start}")
    return faults


def unpacked(root: pathlib.Path, files: "dict[str, str]") -> "list[str]":
    """Packages that pyproject.toml forgets."""
    project = (root / "clients/python/pyproject.toml").read_text(encoding="utf-8")
    listed = set(ast.literal_eval(re.search(r"^packages = (\[.*?\])", project, re.MULTILINE | re.DOTALL)[1]))
    packages = {name_of(path) for path in files if path.endswith("/__init__.py")} | {"limber.v1"}
    return [f"pyproject.toml: packages and folders differ: {name}" for name in sorted(packages ^ listed)]


def check(root: pathlib.Path) -> "list[str]":
    files = {path.relative_to(root).as_posix(): path.read_text(encoding="utf-8")
             for path in sorted((root / PACKAGE).rglob("*.py")) if path.parent.name != "v1"}
    modules = {name_of(path) for path in files}
    faults: "list[str]" = []
    graph: "dict[str, set[str]]" = {}
    for path, text in files.items():
        imports = Imports(path, modules)
        imports.visit(ast.parse(text, path))
        faults += faults_of(path, imports, text)
        graph[name_of(path)] = imports.loading - {"limber"}
    return faults + cycles(graph) + unpacked(root, files)


if __name__ == "__main__":
    faults = check(pathlib.Path(sys.argv[1]))
    print("\n".join(faults) or "Python imports: as drawn")
    sys.exit(1 if faults else 0)
