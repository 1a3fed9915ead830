"""The configuration of a night: every key is checked before the first job. docs/user/fleet.md explains the keys."""

import glob
import os
import re
import shlex
import sys
from pathlib import Path

KEYS = {"logs", "platform", "cloud", "magnetic", "origin", "settings", "out", "lodestone", "threads", "memory_mb"}
OWN_OPTIONS = ("--threads", "--out", "--platform", "--cloud", "--magnetic", "--origin", "--resume", "--quiet")


def refuse(message: str) -> None:
    sys.exit(f"fleet: {message}")


def check_text(key: str, value: object, expected: str) -> None:
    if not isinstance(value, str) or not value.strip() or "\n" in value:
        refuse(f"{key}: expected {expected}, found {value!r}")


def check_setting(name: object, options: object) -> None:
    # Names are parts of file names, in which Snakemake reads braces.
    if not isinstance(name, str) or not name or name.startswith(".") or re.search(r"[/{}\n]", name):
        refuse(f"settings: expected names without '/', braces and a dot at the front, as texts, found {name!r}")
    if not isinstance(options, str):
        refuse(f"settings.{name}: expected the options of `lodestone run` as one text, found {options!r}")
    try:
        words = shlex.split(options)
    except ValueError as error:
        refuse(f"settings.{name}: expected the options of `lodestone run`, found {options!r}: {error}")
    for word in words:
        option = word.split("=")[0]
        if option in OWN_OPTIONS:
            refuse(f"settings.{name}: expected options of `lodestone run` that the night does not set itself, found "
                   f"'{option}'; remove it" + (f", and set the key '{option[2:]}'" if option[2:] in KEYS else ""))


def check(config: dict) -> None:
    """Ends the program with one line for a key that is unknown, missing, or of the wrong type."""
    for key in config:
        if key not in KEYS:
            refuse(f"unknown key '{key}' in the configuration; known: {', '.join(sorted(KEYS))}")
    for key in ("logs", "platform", "out"):
        if key not in config:
            refuse(f"the configuration has no key '{key}'")
    if not {"cloud", "magnetic"} & config.keys():
        refuse("the configuration has neither 'cloud' nor 'magnetic': add a map")
    for key, expected in (("platform", "the path of a file"), ("cloud", "the path of a file"),
                          ("magnetic", "the path of a file"), ("out", "the path of a folder"),
                          ("lodestone", "the path of the program"), ("origin", "x,y,z in metres as one text")):
        if key in config:
            check_text(key, config[key], expected)
    for key in ("platform", "cloud", "magnetic", "out"):
        if re.search("[{}]", config.get(key, "")):
            refuse(f"{key}: expected a path without braces, found '{config[key]}'; rename it")
    for key in ("platform", "cloud", "magnetic"):
        if key in config and not os.path.exists(config[key]):
            refuse(f"{key}: there is no file '{config[key]}'")
    for key in ("threads", "memory_mb"):
        value = config.get(key, 1)
        if not isinstance(value, int) or isinstance(value, bool) or value < 1:
            refuse(f"{key}: expected a whole number of at least 1, found {value!r}")
    settings = config.get("settings", {"run": ""})
    if not isinstance(settings, dict) or not settings:
        refuse("settings: expected names with the options of `lodestone run`, such as {run: --initial-pose auto}, "
               f"found {settings!r}")
    for name, options in settings.items():
        check_setting(name, options)


def logs_of(config: dict) -> dict:
    """The paths of all logs by their names. Ends the program if there are none, or if names are the same."""
    patterns = config["logs"] if isinstance(config["logs"], list) else [config["logs"]]
    if not patterns:
        refuse("logs: expected a pattern of paths, or a list of patterns, found []")
    logs = {}
    for pattern in patterns:
        check_text("logs", pattern, "a pattern of paths, or a list of patterns")
        found = sorted(glob.glob(pattern))
        if not found:
            refuse(f"logs: nothing matches '{pattern}'")
        for log in found:
            name = Path(log).stem if Path(log).suffix in (".bag", ".mcap", ".db3") else Path(log).name
            if re.search("[{}]", name):
                refuse(f"logs: expected names without braces, found '{log}'; rename it")
            if name in logs and logs[name] != log:
                refuse(f"logs: {logs[name]} and {log} have the same name; rename one")
            logs[name] = log
    return logs
