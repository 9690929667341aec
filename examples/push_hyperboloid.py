#!/usr/bin/env python3
"""Opens the sample hyperboloid, deploys it, then pushes one of its joints inwards, step by step."""
import argparse

import limber
import numpy as np


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--angle", type=float, default=50, help="mean opening angle [degree]")
    arguments = parser.parse_args()
    with limber.launch() as server:
        linkage = server.open(sample="hyperboloid")
        linkage.deploy(arguments.angle)
        print(f"deployed: {linkage.wait().mean_angle:.1f} degrees in {len(linkage.frames())} shapes")
        joints = linkage.shape().joints
        joint = int(np.argmax(joints[:, 2]))
        start, inwards = joints[joint], joints.mean(axis=0) - joints[joint]
        target = linkage.attach(joint, position=start, stiffness=5000)
        for share in (0.1, 0.2, 0.3):
            target.move(start + share * inwards)
            energy = linkage.wait().energy
            moved = np.linalg.norm(linkage.shape().joints[joint] - start)
            print(f"pushed by {moved:.3f} m, {energy:.2f} J")


if __name__ == "__main__":
    main()
