#!/usr/bin/env bash
# The state of a Slurm job in Snakemake's words. Reads the controller, which remembers ended jobs for MinJobAge.
set -euo pipefail
state=$(scontrol show job --oneliner "$1" 2>/dev/null | sed -n 's/.* JobState=\([A-Z_]*\).*/\1/p')
case $state in
  COMPLETED) echo success ;;
  PENDING | RUNNING | COMPLETING | CONFIGURING | REQUEUED | SUSPENDED) echo running ;;
  *) echo failed ;;
esac
