"""The steps and the page of a night (tools/fleet), without Snakemake. tests/fleet/slurm.sh runs the whole workflow."""

import importlib.util
import json
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import pandas as pd

import drive

FLEET = Path(__file__).resolve().parents[2] / "tools" / "fleet"


def step(*arguments) -> int:
    call = [sys.executable, FLEET / "step.py", *map(str, arguments)]
    return subprocess.run(call, stderr=subprocess.DEVNULL).returncode


def load(name: str) -> object:
    spec = importlib.util.spec_from_file_location(name, FLEET / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def night() -> object:
    return load("night")


class Fleet(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def read(self, name: str) -> dict:
        return json.loads((self.folder / name).read_text())

    def test_a_refused_log_is_a_result_and_its_report_is_left_out(self):
        (self.folder / "empty.bag").touch()
        self.assertEqual(step(self.folder / "run.json", drive.PROGRAM, "run", self.folder / "empty.bag", "--platform",
                              drive.PLATFORM, "--cloud", drive.CLOUD, "--out", self.folder / "run"), 0)
        note = self.read("run.json")
        self.assertEqual(note["code"], 2)
        self.assertIn("empty.bag", note["message"])
        self.assertEqual(step("--after", self.folder / "run.json", self.folder / "report.json", "false"), 0)
        self.assertEqual(self.read("report.json")["message"], note["message"])

    def test_what_cannot_be_resumed_begins_again(self):
        program = ["sh", "-c", 'case "$*" in *--resume*) echo "lodestone: run: this call cannot be resumed: the log was'
                   ' of 3 bytes" >&2; exit 2;; esac', "sh"]
        self.assertEqual(step(self.folder / "run.json", *program, "--resume", "--quiet"), 0)
        self.assertEqual(self.read("run.json")["code"], 0)

    def test_a_killed_or_unknown_command_leaves_no_result(self):
        for command in (["sh", "-c", "kill -KILL $$"], ["false"], ["no-such-program"]):
            self.assertEqual(step(self.folder / "run.json", *command), 1)
            self.assertFalse((self.folder / "run.json").exists())

    def experiment_step(self, kind: str, *commands) -> tuple:
        """Whether the step is done, and its log."""
        step = {"kind": kind, "folder": "work/a", "log": "a.log", "commands": commands, "intermediate": ["work/a/b"],
                "stamp": '{"fingerprint": "f"}'}
        (self.folder / "logs").mkdir(exist_ok=True)
        (self.folder / "logs/steps.json").write_text(json.dumps({"program": "/bin/sh", "threads": 2, "steps": [step]}))
        code = subprocess.run([sys.executable, FLEET / "experiment_step.py", "work/a"], cwd=self.folder).returncode
        self.assertEqual((self.folder / "work/a/step.json").exists(), code == 0)
        return code == 0, (self.folder / "a.log").read_text()

    def test_a_step_of_an_experiment_is_done_when_all_its_commands_are(self):
        done, log = self.experiment_step("log", ["-c", "echo first; touch work/a/b"], ["-c", "echo second"])
        self.assertTrue(done)
        self.assertEqual([line for line in log.splitlines() if line[0] != "$"], ["first", "second"])
        self.assertEqual(self.read("work/a/step.json")["fingerprint"], "f")
        self.assertFalse((self.folder / "work/a/b").exists(), "intermediate files are removed")
        (self.folder / "work/a/of an earlier call").touch()
        self.assertTrue(self.experiment_step("log", ["-c", "true"])[0])
        self.assertEqual([file.name for file in (self.folder / "work/a").iterdir()], ["step.json"])

    def test_a_step_of_an_experiment_that_failed_leaves_no_stamp_and_says_why(self):
        for kind, command, reason in (("log", "exit 3", "exit code 3"), ("run", "exit 2", "exit code 2"),
                                      ("run", "kill -KILL $$", "ended by signal SIGKILL")):
            done, log = self.experiment_step(kind, ["-c", command], ["-c", "echo second"])
            self.assertFalse(done)
            self.assertEqual(log.splitlines()[-1], reason)

    def test_a_lost_track_is_a_result_of_an_experiment(self):
        self.assertTrue(self.experiment_step("run", ["-c", "exit 3"])[0])

    def add(self, name: str, code: int = 0, message: str = "", source: Path = drive.RUN) -> Path:
        folder = self.folder / "drives" / name
        folder.mkdir(parents=True)
        (folder / "check.json").write_text(json.dumps({"code": 0, "message": ""}))
        (folder / "run.run.json").write_text(json.dumps({"code": code, "message": message}))
        if code != 2:
            shutil.copytree(source, folder / "run" / "smoother")
        return folder / "run" / "smoother"

    def test_the_page_puts_the_worst_first_and_ranks_places_over_all_drives(self):
        for name in ("a", "b"):
            self.add(name)
        self.add("c", code=2, message="lodestone: <c.bag>: empty")
        lost = self.add("d", code=3)
        # The last second of d is lost: these scans have no pose.
        scans = pd.read_csv(lost / "diagnostics.csv")
        gone = scans["t_s"] > scans["t_s"].max() - 1.0
        scans.loc[gone, "health"] = "lost"
        scans.to_csv(lost / "diagnostics.csv", index=False)
        poses = (lost / "trajectory.tum").read_text().splitlines()
        (lost / "trajectory.tum").write_text("\n".join(poses[: len(poses) - int(gone.sum())]) + "\n")
        (lost / "stale_places.csv").write_text("x_m,y_m,largest_difference_ut\n1000,2000,12.5\n")
        night().make(self.folder)
        drives = pd.read_csv(self.folder / "drives.csv")
        self.assertEqual(list(drives["drive"]), ["c", "d", "a", "b"])
        self.assertEqual(list(drives["outcome"]), ["refused", "regained", "done", "done"])
        self.assertAlmostEqual(drives["lost_s"][1], 1.0, delta=0.11)
        places = pd.read_csv(self.folder / "places.csv")
        degenerate = places[places["kind"] == "degenerate"]  # the whole tunnel, for all three drives
        self.assertEqual(set(degenerate["drives"]), {3})
        total = 3 * (scans["t_s"].max() - scans["t_s"].min()) - drives["lost_s"][1]
        self.assertAlmostEqual(degenerate["seconds"].sum(), total, delta=0.5)
        stale = places[places["kind"] == "stale"]
        self.assertEqual(list(stale["difference_ut"]), [12.5])
        self.assertEqual((list(stale["x_m"]), list(stale["y_m"])), ([1002.5], [2002.5]))
        page = (self.folder / "index.html").read_text()
        self.assertIn("4 drives", page)
        self.assertIn("1 refused, 1 regained, 2 done", page)
        self.assertIn("&lt;c.bag&gt;", page)
        self.assertRegex(page, r">\d+ m</text>", "the plan has a scale bar")

    def refusal(self, **keys) -> str:
        """The line of a configuration with some keys changed, or an empty text."""
        (self.folder / "a.bag").touch()
        config = {"logs": f"{self.folder}/*.bag", "platform": str(drive.PLATFORM), "cloud": str(drive.CLOUD),
                  "out": "night"} | keys
        configuration = load("configuration")
        try:
            configuration.check(config)
            self.assertEqual(list(configuration.logs_of(config)), ["a"])
        except SystemExit as end:
            return end.code
        return ""

    def test_a_configuration_is_checked_before_any_job(self):
        for keys in ({}, {"settings": {"run": "", "b": "--initial-pose auto --set 'a.b=1'"}, "threads": 2},
                     {"origin": "1,2,3", "memory_mb": 1}):
            self.assertEqual(self.refusal(**keys), "")
        for key, value in (("logs", []), ("logs", None), ("logs", [5]), ("logs", ""), ("settings", {}),
                           ("settings", None), ("settings", "--initial-pose auto"), ("settings", {"r{x}": ""}),
                           ("settings", {"a/b": ""}), ("settings", {"..": ""}), ("settings", {5: ""}),
                           ("threads", "abc"), ("threads", 0), ("threads", True), ("threads", 1.5), ("threads", None),
                           ("memory_mb", "much"), ("out", 5), ("out", ""), ("platform", None), ("cloud", ["a", "b"]),
                           ("origin", [1, 2, 3]), ("lodestone", 5)):
            line = self.refusal(**{key: value})
            self.assertTrue(line.startswith(f"fleet: {key}: expected "), (key, value, line))
            named = next(iter(value)) if isinstance(value, (dict, list)) and value else value
            self.assertIn(repr(named), line.split("found ")[1])
            self.assertNotIn("\n", line)

    def test_a_setting_has_no_option_that_the_night_sets(self):
        for options in ("--threads 2", "--threads=2", "--out x", "--platform p", "--cloud c", "--magnetic m",
                        "--origin 1,2,3", "--resume", "--estimator ndt --quiet"):
            self.assertRegex(self.refusal(settings={"run": options}), "^fleet: settings.run: expected .*, found '--")
        self.assertIn("settings.run: expected", self.refusal(settings={"run": "--set 'a"}))
        self.assertIn("settings.run: expected", self.refusal(settings={"run": None}))

    def test_the_scale_bar_has_a_round_length(self):
        for at_most, length in ((9.9, 5.0), (10.0, 10.0), (49.0, 20.0), (0.7, 0.5)):
            self.assertAlmostEqual(night().round_length(at_most), length)

    def test_a_night_without_any_run_has_a_page_too(self):
        self.add("c", code=2, message="refused")
        night().make(self.folder)
        self.assertIn("1 refused", (self.folder / "index.html").read_text())


if __name__ == "__main__":
    unittest.main()
