#!/usr/bin/env python3
"""Draws motions as a contact sheet: each with its default dynamics and in the published form, frames beside curves.

    bench/calm_sheet.py SHEET.png BODY ...     # BODY: the name of a sample, or a mesh file

Each body has keys of a quarter of its length at nodes far from the fixed ones: one, and two that differ. Bodies of files are
held at the lowest 5 % of their height.
"""

from __future__ import annotations

import argparse
import pathlib

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.collections import PolyCollection  # noqa: E402

import limber  # noqa: E402

RATE, SECONDS, SHOWN, REACH = 24, 4, 9, 0.25
FORMS = {"default": {}, "published": {"discretisation": "differences", "damping_ratio": 0.0, "force_smoothing": 0.0}}


def far_nodes(rest: np.ndarray, fixed: np.ndarray, count: int) -> "list[int]":
    distance = np.linalg.norm(rest[:, None] - rest[fixed][None], axis=2).min(axis=1)
    chosen: "list[int]" = []
    for _ in range(count):
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(rest - rest[chosen[-1]], axis=1))
    return chosen


def lowest(rest: np.ndarray) -> np.ndarray:
    heights = rest[:, 1]
    return np.flatnonzero(heights <= heights.min() + 0.05 * np.ptp(heights))


def motions(server: "limber.Server", body: str, keys: int):
    """Yields the form's name, the result, rest, surface, frames and the node of the first key."""
    for name, dynamics in FORMS.items():
        options = {"frames": SECONDS * RATE + 1, "frames_per_second": RATE, "period_frames": RATE * 4 / 3}
        if pathlib.Path(body).exists():
            scene = limber.scene_from_mesh(body, **options)
            probe = server.open(scene, progress=False)
            fixed = lowest(probe.geometry().rest)
            probe.close()
            scene = limber.scene_from_mesh(body, fixed_nodes=fixed.tolist(), **options, **dynamics)
        else:
            scene = server.sample(body)
            fixed = np.array(list(scene.fixed_nodes), dtype=int)
            del scene.constraints[:]
            scene.frames = options["frames"]
            made = limber.dynamics(**{key: options[key] for key in ("frames_per_second", "period_frames")}, **dynamics)
            scene.ClearField("dynamics")
            for key, value in made.values.items():
                setattr(scene.dynamics, key, value)
        session = server.open(scene, progress=False)
        try:
            geometry = session.geometry()
            rest = np.asarray(geometry.rest, dtype=float)
            length = np.ptp(rest, axis=0).max()
            nodes = far_nodes(rest, fixed, 1)
            random = np.random.default_rng(43)
            edits = []
            for i in range(keys):
                direction = random.normal(size=3)
                direction *= REACH * length / np.linalg.norm(direction)
                edits.append(limber.add(frame=(i + 1) * SECONDS * RATE // (keys + 1), node=nodes[0], displacement=direction, exact=True))
            session.edit(edits)
            result = session.wait(until="checked", timeout=600)
            yield name, result, rest, geometry.surface, session.frames().astype(float), nodes[0], length
        finally:
            session.close()


def draw(axes, points: np.ndarray, triangles: np.ndarray, box: "tuple[np.ndarray, np.ndarray]") -> None:
    """From the side and a little above."""
    turn, tilt = np.radians(-30), np.radians(15)
    across = np.array([np.cos(turn), 0, -np.sin(turn)])
    to_eye = np.array([np.sin(turn) * np.cos(tilt), np.sin(tilt), np.cos(turn) * np.cos(tilt)])
    upward = np.cross(to_eye, across)
    plane = np.stack([points @ across, points @ upward], axis=1)
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    light = 0.35 + 0.6 * np.abs(normals @ (to_eye + upward) / np.sqrt(2))
    order = np.argsort(corners.mean(axis=1) @ to_eye)
    axes.add_collection(PolyCollection(plane[triangles][order], facecolors=np.outer(light, (0.55, 0.7, 0.9)).clip(0, 1)[order]))
    axes.set_xlim(box[0][0], box[1][0])
    axes.set_ylim(box[0][1], box[1][1])
    axes.set_aspect("equal")
    axes.axis("off")


def view_box(rest: np.ndarray) -> "tuple[np.ndarray, np.ndarray]":
    middle = rest.mean(axis=0)
    across = np.array([np.cos(np.radians(-30)), 0, -np.sin(np.radians(-30))])
    reach = 0.75 * np.ptp(rest, axis=0).max()
    centre = np.array([middle @ across, middle[1]])
    return centre - reach, centre + reach


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sheet", type=pathlib.Path)
    parser.add_argument("bodies", nargs="+")
    chosen = parser.parse_args()
    rows = [(body, keys) for body in chosen.bodies for keys in (1, 2)]
    figure, axes = plt.subplots(2 * len(rows), SHOWN + 1, figsize=(1.3 * (SHOWN + 3), 2.6 * len(rows)),
                                gridspec_kw={"width_ratios": [2.2] + [1] * SHOWN}, squeeze=False)
    with limber.launch() as server:
        for number, (body, keys) in enumerate(rows):
            for form, (name, result, rest, surface, frames, node, length) in enumerate(motions(server, body, keys)):
                line = axes[2 * number + form]
                moved = (frames[:, node] - rest[node]) / length
                line[0].plot(np.arange(len(frames)) / RATE, moved)
                line[0].set_ylim(-0.5, 0.5)
                error = result.motion_error
                line[0].set_title(f"{pathlib.Path(body).stem}, {keys} key{'s' if keys > 1 else ''}, {name}: zigzag "
                                  f"{error.zigzag_share:.2g}, share {result.high_frequency_share:.1g}", fontsize=7, loc="left")
                line[0].tick_params(labelsize=6)
                box = view_box(rest)
                for place, frame in enumerate(np.linspace(0, len(frames) - 1, SHOWN + 2).round().astype(int)[1:-1]):
                    draw(line[1 + place], frames[frame], surface, box)
                print(f"{body}, {keys}, {name}: zigzag {error.zigzag_share:.3g}, share {result.high_frequency_share:.3g}, "
                      f"{result.status}: {result.message}")
    figure.tight_layout(pad=0.3)
    figure.savefig(chosen.sheet, dpi=70)


if __name__ == "__main__":
    main()
