"""The page as blocks, and how blocks are written as Markdown and HTML."""

from __future__ import annotations

import html
from dataclasses import dataclass
from typing import Union


@dataclass
class Heading:
    level: int
    text: str


@dataclass
class Paragraph:
    text: str


@dataclass
class Picture:
    """path: relative to the page."""

    path: str
    text: str


@dataclass
class Cell:
    """missed: shown red."""

    text: str
    missed: bool = False


@dataclass
class Table:
    head: "list[str]"
    rows: "list[list[Union[str, Cell]]]"


Block = Union[Heading, Paragraph, Picture, Table]


def _cell(cell: "Union[str, Cell]") -> Cell:
    return cell if isinstance(cell, Cell) else Cell(cell)


def to_markdown(blocks: "list[Block]") -> str:
    parts = []
    for block in blocks:
        if isinstance(block, Heading):
            parts.append("#" * block.level + " " + block.text)
        elif isinstance(block, Paragraph):
            parts.append(block.text)
        elif isinstance(block, Picture):
            parts.append(f"![{block.text}]({block.path})")
        else:
            lines = ["| " + " | ".join(block.head) + " |", "|" + "---|" * len(block.head)]
            for row in block.rows:
                cells = [_cell(cell) for cell in row]
                texts = [cell.text.replace("|", "\\|") for cell in cells]
                # Markdown has no colours; this character is one.
                texts = [f"\N{LARGE RED CIRCLE} **{text}**" if cell.missed else text for text, cell in zip(texts, cells)]
                lines.append("| " + " | ".join(texts) + " |")
            parts.append("\n".join(lines))
    return "\n\n".join(parts) + "\n"


STYLE = """
body { font: 15px/1.45 sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em; color: #222; background: #fff; }
table { border-collapse: collapse; margin: 1em 0; font-size: 13px; }
th, td { border: 1px solid #ccc; padding: 3px 8px; text-align: left; vertical-align: top; }
th { background: #f2f2f2; }
td.missed { color: #fff; background: #c62828; font-weight: bold; }
img { max-width: 100%; }
"""


def to_html(blocks: "list[Block]", title: str) -> str:
    parts = []
    for block in blocks:
        if isinstance(block, Heading):
            parts.append(f"<h{block.level}>{html.escape(block.text)}</h{block.level}>")
        elif isinstance(block, Paragraph):
            parts.append(f"<p>{html.escape(block.text)}</p>")
        elif isinstance(block, Picture):
            parts.append(f'<p><img src="{html.escape(block.path)}" alt="{html.escape(block.text)}"></p>')
        else:
            head = "".join(f"<th>{html.escape(text)}</th>" for text in block.head)
            body = []
            for row in block.rows:
                cells = [_cell(cell) for cell in row]
                body.append("<tr>" + "".join(f'<td{" class=missed" if cell.missed else ""}>{html.escape(cell.text)}</td>'
                                             for cell in cells) + "</tr>")
            parts.append(f"<table>\n<tr>{head}</tr>\n" + "\n".join(body) + "\n</table>")
    return (f"<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{html.escape(title)}</title>\n"
            f"<style>{STYLE}</style>\n</head>\n<body>\n" + "\n".join(parts) + "\n</body>\n</html>\n")
