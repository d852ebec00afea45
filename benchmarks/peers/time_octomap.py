"""Times of OctoMap that marks free space; run by the peers' Python, never imported by clearway.

    python time_octomap.py returns.npy voxel_m calls

Prints processor times of calls as JSON: the same returns again and again, from the origin.
"""

import json
import sys
import time

import numpy as np
import pyoctomap


def main():
    path, voxel_m, calls = sys.argv[1:]
    points, origin = np.load(path), np.zeros(3)
    tree = pyoctomap.OcTree(float(voxel_m))
    taken = []
    for _ in range(int(calls) + 1):
        began = time.process_time()
        tree.insertPointCloud(points, origin, discretize=True)
        taken.append(time.process_time() - began)
    json.dump(taken[1:], sys.stdout)


if __name__ == "__main__":
    main()
