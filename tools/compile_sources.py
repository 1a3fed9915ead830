#!/usr/bin/env python3
"""Compiles every source of a compilation database alone, without code generation, and runs clang-tidy on some of them.

    tools/compile_sources.py build/sources/compile_commands.json            compile every source
    tools/compile_sources.py build/sources/compile_commands.json --tidy 30  and clang-tidy for the last 30 commits

Ends with 1 if a source does not compile or clang-tidy has a finding. `.clang-tidy` lists the checks.
"""
import argparse
import json
import os
import shlex
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def syntax_command(entry):
    """The compiler's call of an entry, which checks the source and writes nothing."""
    words = shlex.split(entry["command"])
    output = words.index("-o")
    del words[output : output + 2]
    return [*words, "-fsyntax-only"]


def call(entry, command):
    done = subprocess.run(command, cwd=entry["directory"], capture_output=True, text=True)
    return entry["file"], done.returncode, done.stdout + done.stderr


def recent_files(commits):
    listed = subprocess.run(["git", "log", f"-{commits}", "--name-only", "--format="], cwd=ROOT, check=True,
                            capture_output=True, text=True)
    return {str(ROOT / line) for line in listed.stdout.split("\n") if line}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("database", help="compile_commands.json of a build without unity and precompiled headers")
    parser.add_argument("--tidy", type=int, metavar="COMMITS", default=0,
                        help="clang-tidy for sources of so many commits")
    options = parser.parse_args()
    entries = {entry["file"]: entry for entry in json.loads(Path(options.database).read_text())}
    work = [(entry, syntax_command(entry)) for _, entry in sorted(entries.items())]
    if options.tidy:
        recent = recent_files(options.tidy)
        tidy = ["clang-tidy", "--quiet", "--warnings-as-errors=*", "-p", str(Path(options.database).parent)]
        work += [(entry, [*tidy, file]) for file, entry in sorted(entries.items()) if file in recent]
    failed = 0
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for file, status, output in pool.map(lambda one: call(*one), work):
            if status != 0:
                failed += 1
                print(f"{os.path.relpath(file, ROOT)}:\n{output}", flush=True)
    print(f"sources: {len(entries)} compiled alone, {len(work) - len(entries)} with clang-tidy, {failed} with findings")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
