#!/usr/bin/env bash
# A run as a PBS job that goes on in as many jobs as it needs:
#   qsub -v scene=runs/scenes/window.toml,out=out/window runs/jobs/pbs.sh
# PBS gives no early warning, so the solver is told the limit: keep --walltime equal to it. It saves
# a checkpoint in time and exits with 85, and the job submits itself again.
#PBS -N brisance
#PBS -l select=1:ncpus=16:mpiprocs=16
#PBS -l walltime=04:00:00
#PBS -j oe
set -u
cd "${PBS_O_WORKDIR:-.}" || exit 1

# shellcheck disable=SC1091
source .venv/bin/activate
code=0
mpirun --bind-to core \
    python -m solver "$scene" -o "$out" --restart --walltime 4:00:00 --walltime-margin 5m || code=$?
if [ $code -eq 85 ]; then
    if [ -n "${PBS_JOBID:-}" ]; then qsub -v "scene=$scene,out=$out" runs/jobs/pbs.sh; fi
fi
exit $code
