#!/usr/bin/env python3
"""Writes half.pcd beside cloud.pcd of a simulated drive: the cloud without the points nearest to its second half.

With this map, a robot without magnetometers is lost for half of its log.
"""
import argparse
import pathlib

import numpy as np

BLOCK_POINTS = 100_000


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drive", type=pathlib.Path, help="folder made by 'lodestone simulate'")
    folder = parser.parse_args().drive
    content = (folder / "cloud.pcd").read_bytes()
    begin = content.index(b"DATA binary\n") + len(b"DATA binary\n")
    points = np.frombuffer(content[begin:], dtype="<f4").reshape(-1, 3)
    path = np.loadtxt(folder / "truth.tum")[::100, 1:3]
    nearest = np.concatenate([
        np.argmin(((points[i:i + BLOCK_POINTS, None, :2] - path) ** 2).sum(axis=2), axis=1)
        for i in range(0, len(points), BLOCK_POINTS)
    ])
    kept = points[nearest <= len(path) // 2]
    header = []
    for line in content[:begin].decode().splitlines():
        word = line.split()[0]
        header.append(f"{word} {len(kept)}" if word in ("WIDTH", "POINTS") else line)
    (folder / "half.pcd").write_bytes("\n".join(header).encode() + b"\n" + kept.tobytes())
    print(f"{folder / 'half.pcd'}: {len(kept)} of {len(points)} points")


if __name__ == "__main__":
    main()
