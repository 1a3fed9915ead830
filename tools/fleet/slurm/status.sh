#!/usr/bin/env bash
# The state of a Slurm job in Snakemake's words. Reads the controller, which remembers ended jobs for MinJobAge. A
# controller that does not answer is asked again later.
set -euo pipefail
if ! job=$(scontrol show job --oneliner "$1" 2>&1); then
  [[ $job == *"Invalid job id"* ]] && echo failed || echo running
  exit
fi
case $(sed -n 's/.* JobState=\([A-Z_]*\).*/\1/p' <<<"$job") in
  COMPLETED) echo success ;;
  PENDING | RUNNING | COMPLETING | CONFIGURING | REQUEUED | SUSPENDED) echo running ;;
  *) echo failed ;;
esac
