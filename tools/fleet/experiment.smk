# The steps of an experiment, as `lodestone reproduce` and `lodestone ablate` list them in logs/steps.json of the folder
# of results: each makes one folder. A folder that is not kept is removed after the last step that reads it.
import json
import sys
from pathlib import Path

FLEET = Path(workflow.basedir)
PLAN = json.loads(Path("logs/steps.json").read_text())
STEPS = PLAN["steps"]
MEMORY_MB = 2000


def target(step):
    return f"{step['folder']}/step.json" if step["kept"] else temp(directory(step["folder"]))


TARGETS = {step["folder"]: target(step) for step in STEPS}


localrules: all


rule all:
    input: [TARGETS[step["folder"]] for step in STEPS if step["kept"]],


for number, step in enumerate(STEPS):
    rule:
        name: f"{step['kind']}_{number}"
        input: [str(TARGETS[folder]) for folder in step["needs"]],
        output: TARGETS[step["folder"]],
        log: step["log"],
        params: folder=step["folder"],
        threads: PLAN["threads"],
        # Runs before logs: a log is large, and exists until its runs are done.
        priority: len(STEPS) - number + (len(STEPS) if step["kind"] in ("run", "difference") else 0),
        resources: mem_mb=MEMORY_MB,
        shell: "{sys.executable:q} {FLEET:q}/experiment_step.py {params.folder:q}"
