#!/usr/bin/env python3
"""Runs the accuracy table of docs/accuracy.md: sequences x LiDAR ranges x seeds, three estimators each.

    tools/accuracy_table.py --out results/accuracy [--lodestone build/release/bin/lodestone] [--seeds 1,2,3]
                            [--sequences 1,2,3,4] [--ranges 100,10] [--noise-ut 1]

For each sequence and seed: simulate, build the magnetic map from the survey drive, run at each range. Logs are removed
once they have been run, so that disk stays bounded; what is done is skipped, so that a stopped table goes on. Prints a
Markdown table and writes it, and all figures as CSV, into --out. Needs Python's standard library alone.
"""
import argparse
import csv
import json
import pathlib
import shutil
import subprocess
import sys

WORLD_OF_SEQUENCE = {"1": "warehouse", "2": "warehouse", "3": "tunnel", "4": "tunnel"}
# ATE in metres that the paper states for its method: LiDAR range 100 m and 10 m.
PAPER = {"1": {100: 0.024, 10: 0.024}, "2": {100: 0.025, 10: 0.030},
         "3": {100: 0.029, 10: 0.029}, "4": {100: 0.040, 10: 0.040}}
ESTIMATORS = ["smoother", "ieskf", "lidar-inertial"]
ROOT = pathlib.Path(__file__).resolve().parent.parent


def call(command, log):
    with open(log, "a", encoding="utf-8") as stream:
        stream.write("$ " + " ".join(map(str, command)) + "\n")
        stream.flush()
        code = subprocess.run(command, stdout=stream, stderr=stream, check=False).returncode
    if code not in (0, 3):  # 3: an estimator lost track, which some of these runs must show
        sys.exit(f"accuracy_table: exit code {code}; see {log}")


def run_case(arguments, sequence, seed):
    folder = arguments.out / f"sequence{sequence}_seed{seed}_noise{arguments.noise_ut:g}"
    results = {r: folder / f"range{r}" for r in arguments.ranges}
    if not all((path / "summary.json").exists() for path in results.values()):
        data = folder / "data"
        folder.mkdir(parents=True, exist_ok=True)
        log = folder / "commands.log"
        world = ROOT / "config" / "worlds" / (WORLD_OF_SEQUENCE[sequence] + ".yaml")
        call([arguments.lodestone, "simulate", world, "--sequence", sequence, "--seed", str(seed), "--out", data,
              "--set", f"sensors.magnetometers.noise_ut={arguments.noise_ut:g}"], log)
        call([arguments.lodestone, "map", "magnetic", data / "survey.bag", "--trajectory", data / "survey.tum",
              "--platform", data / "platform.yaml", "--out", data / "field.yaml"], log)
        for lidar_range, path in results.items():
            call([arguments.lodestone, "run", data / "log.bag", "--platform", data / "platform.yaml",
                  "--cloud", data / "cloud.pcd", "--magnetic", data / "field.yaml",
                  "--initial-pose-from", data / "truth.tum", "--truth", data / "truth.tum",
                  "--max-range", str(lidar_range), "--estimator", ",".join(ESTIMATORS), "--out", path], log)
        shutil.rmtree(data)
    rows = []
    for lidar_range, path in results.items():
        for estimator in ESTIMATORS:
            summary = json.loads((path / estimator / "summary.json").read_text())
            rows.append({"sequence": sequence, "range_m": lidar_range, "noise_ut": arguments.noise_ut, "seed": seed,
                         **{key: summary[key] for key in (
                             "estimator", "success", "ate_m", "ate_se3_m", "max_error_m", "heading_rmse_deg",
                             "nees_pose", "degenerate_scans", "scans", "real_time_factor")}})
    return rows


def markdown(rows, ranges):
    lines = ["| sequence | range m | paper ATE m | smoother ATE m (mean, worst) | ieskf ATE m (mean, worst) | "
             "worst ratio to ieskf | lidar-inertial ATE m (mean) | lidar-inertial max m (least) | smoother NEES (by seed) | "
             "success smoother, ieskf, lidar-inertial |",
             "|---|---|---|---|---|---|---|---|---|---|"]
    for sequence in sorted({row["sequence"] for row in rows}):
        for lidar_range in ranges:
            part = {name: [row for row in rows if row["sequence"] == sequence and row["range_m"] == lidar_range
                           and row["estimator"] == name] for name in ESTIMATORS}
            ate = {name: [row["ate_m"] for row in part[name]] for name in ESTIMATORS}

            def pair(values):
                return f"{sum(values) / len(values):.4f}, {max(values):.4f}"

            ratio = max(a / b for a, b in zip(ate["smoother"], ate["ieskf"]))
            lost = [row["max_error_m"] for row in part["lidar-inertial"]]
            nees = ", ".join(f"{row['nees_pose']:.2f}" for row in part["smoother"])
            success = ", ".join(f"{sum(bool(row['success']) for row in part[name])}/{len(part[name])}"
                                for name in ESTIMATORS)
            mean_lidar = sum(ate["lidar-inertial"]) / len(ate["lidar-inertial"])
            lines.append(f"| {sequence} {WORLD_OF_SEQUENCE[sequence]} | {lidar_range} | "
                         f"{PAPER[sequence].get(lidar_range, float('nan')):.3f} | {pair(ate['smoother'])} | "
                         f"{pair(ate['ieskf'])} | {ratio:.2f} | {mean_lidar:.4f} | {min(lost):.3f} | {nees} | {success} |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--lodestone", type=pathlib.Path, default=ROOT / "build/release/bin/lodestone")
    parser.add_argument("--seeds", default="1,2,3", type=lambda text: [int(part) for part in text.split(",")])
    parser.add_argument("--sequences", default="1,2,3,4", type=lambda text: text.split(","))
    parser.add_argument("--ranges", default="100,10", type=lambda text: [int(part) for part in text.split(",")])
    parser.add_argument("--noise-ut", default=1.0, type=float)
    arguments = parser.parse_args()
    rows = []
    for seed in arguments.seeds:
        for sequence in arguments.sequences:
            rows += run_case(arguments, sequence, seed)
            print(f"sequence {sequence}, seed {seed}: done", file=sys.stderr)
    name = f"table_noise{arguments.noise_ut:g}"
    with open(arguments.out / (name + ".csv"), "w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    table = markdown(rows, arguments.ranges)
    (arguments.out / (name + ".md")).write_text(table + "\n", encoding="utf-8")
    print(table)


if __name__ == "__main__":
    main()
