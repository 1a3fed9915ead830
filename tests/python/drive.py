"""A short simulated drive with its maps, and a run of the program over it: the input of all tests of the Python module.

    drive.py        makes the drive in the folder LODESTONE_DRIVE, with the program LODESTONE_PROGRAM
"""

import os
import shutil
import subprocess
from pathlib import Path

PROGRAM = os.environ["LODESTONE_PROGRAM"]
FOLDER = Path(os.environ["LODESTONE_DRIVE"])
WORLDS = Path(__file__).resolve().parents[2] / "config" / "worlds"

LOG = FOLDER / "log.bag"
PLATFORM = FOLDER / "platform.yaml"
CLOUD = FOLDER / "cloud.pcd"
FIELD = FOLDER / "field.yaml"
TRUTH = FOLDER / "truth.tum"
RUN = FOLDER / "run" / "smoother"


def lodestone(*arguments) -> str:
    """Runs the program. Returns its standard output."""
    call = [PROGRAM, *map(str, arguments)]
    return subprocess.run(call, check=True, stdout=subprocess.PIPE, text=True).stdout


def make() -> None:
    shutil.rmtree(FOLDER, ignore_errors=True)
    lodestone("simulate", WORLDS / "tunnel.yaml", "--out", FOLDER, "--duration", 6, "--only", "log,cloud", "--set",
              "sensors.lidar.rows=16", "--set", "sensors.lidar.columns=512", "--set", "sensors.wheels.rate_hz=100")
    lodestone("map", "magnetic", LOG, "--trajectory", TRUTH, "--platform", PLATFORM, "--out", FIELD)
    lodestone("run", LOG, "--platform", PLATFORM, "--cloud", CLOUD, "--magnetic", FIELD, "--initial-pose-from", TRUTH,
              "--out", FOLDER / "run")


if __name__ == "__main__":
    make()
