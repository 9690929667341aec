"""The bodies of ../shared/data/bodies (or $LIMBER_SHARED) as scenes: mesh, materials, fixed nodes, path constraints."""

import os
import pathlib

import limber
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]


def folder() -> pathlib.Path:
    """Folder of the bodies; may not exist."""
    return pathlib.Path(os.environ.get("LIMBER_SHARED", ROOT.parent / "shared")) / "data" / "bodies"


def fixed_nodes(path: pathlib.Path) -> list[int]:
    """A .bou file: a count, then that many node ids from 0."""
    count, *ids = map(int, path.read_text().split())
    if len(ids) != count:
        raise ValueError(f"{path} announces {count} nodes and lists {len(ids)}")
    return ids


def scene(name: str, frames: int, **options) -> "limber.scenes.messages.Scene":
    """A body of its folder: mesh.abq with the materials of mesh.elastic, held at con_nodes.bou."""
    body = folder() / name
    return limber.scene_from_mesh(body / "mesh.abq", name=name, frames=frames,
                                  fixed_nodes=fixed_nodes(body / "con_nodes.bou"), **options)


# path_con.txt says per constraint: frame, 3, two rows of three numbers, the number of groups (1), the number of nodes, the nodes.
# The meaning of the rows was derived from the numbers (tests/integration/test_shared_bodies.py repeats it):
#
# - The nodes, counted from 0, are eight neighbours at the tip of the snout; counted from 1 they are spread over the head.
# - The second row stays within 0.8 of (4.81, 2.80, 0.05), which is ten times the nodes' mean at rest. It is the mean position of
#   the group in that frame of the (unpublished) motion that was edited, in units of a tenth of the mesh's.
# - The first row is a displacement from there. Its heights scatter by 0.43, those of the second row by 0.33, but those of their
#   sum only by 0.25. Along time the sum is smooth, while each row alone jumps from constraint to constraint. The sums sweep an
#   arc around the feet just above the ground: the dinosaur lowers its head and looks along it.
#
# The target is therefore (first + second) / 10, a position in the mesh's space.
PATH_UNIT = 0.1


def path_constraints(path: pathlib.Path) -> list[dict]:
    """path_con.txt as arguments of Session.add, in the order of frames, with the original rows."""
    numbers = iter(path.read_text().split())

    def take(kind, count):
        return [kind(next(numbers)) for _ in range(count)]

    found = []
    for _ in range(*take(int, 1)):
        frame, dimension = take(int, 2)
        displacement, barycentre = np.array(take(float, dimension)), np.array(take(float, dimension))
        groups, count = take(int, 2)
        if groups != 1:
            raise ValueError(f"{path}: a constraint of {groups} groups")
        found.append({"frame": frame, "nodes": take(int, count), "displacement": displacement,
                      "barycentre": barycentre, "position": (displacement + barycentre) * PATH_UNIT})
    return sorted(found, key=lambda constraint: constraint["frame"])
