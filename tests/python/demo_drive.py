"""Localizes the drive of tools/demo.sh from Python: demo_drive.py FOLDER.

The trajectory must have the bytes of the demo's. tools/package.sh runs this where only the packages are installed.
"""

import sys
from pathlib import Path

import lodestone

folder = Path(sys.argv[1])
site = lodestone.load_site(folder / "platform.yaml", folder / "cloud.pcd", folder / "field.yaml")
result = lodestone.localize(folder / "log.bag", site, initial_pose=lodestone.read_trajectory(folder / "truth.tum"))
result.best.write_tum(folder / "python.tum")
if (folder / "python.tum").read_bytes() != (folder / "run" / "smoother" / "trajectory.tum").read_bytes():
    sys.exit("the trajectory differs from that of lodestone run")
print(f"lodestone {lodestone.__version__}: {result.scans} scans, the bytes of lodestone run")
