#!/usr/bin/env python3
"""Opens the sample hyperboloid, deploys it, holds its foot, and pushes a joint of its rim inwards, step by step."""
import limber
import numpy as np


def main() -> None:
    with limber.launch() as server:
        linkage = server.open(sample="hyperboloid")
        linkage.deploy(50)
        print(f"deployed: {linkage.wait().mean_angle:.1f} degrees in {len(linkage.frames())} shapes")
        joints = linkage.shape().joints
        for foot in np.argsort(joints[:, 2])[:12]:
            linkage.pin(int(foot), "motion")
        rim = int(np.argmax(joints[:, 2]))
        start, inwards = joints[rim], (joints.mean(axis=0) - joints[rim]) * (1, 1, 0)
        target = linkage.attach(rim, position=start, stiffness=5000)
        for share in (0.1, 0.2, 0.3):
            target.move(start + share * inwards)
            energy = linkage.wait().energy
            moved = np.linalg.norm(linkage.shape().joints[rim] - start)
            print(f"pushed by {moved:.3f} m, {energy:.2f} J")


if __name__ == "__main__":
    main()
