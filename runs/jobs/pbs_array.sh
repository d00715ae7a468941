#!/usr/bin/env bash
# A sweep as an array of PBS jobs, one run each:
#   table=runs/sweep/gas.toml
#   qsub -J 0-$(($(python -m runs sweep $table --count) - 1)) -v table=$table,out=out/gas runs/jobs/pbs_array.sh
# PBS gives no early warning: the solver is told the limit, saves a checkpoint in time and exits with
# 85. A member of an array cannot submit itself again; submit the same array until
# `python -m runs sweep TABLE -o OUT --list` says that all are done: what is done is not run again.
#PBS -N brisance-sweep
#PBS -l select=1:ncpus=4:mpiprocs=4
#PBS -l walltime=04:00:00
#PBS -j oe
set -u
cd "${PBS_O_WORKDIR:-.}" || exit 1

# shellcheck disable=SC1091
source .venv/bin/activate
python -m runs sweep "$table" -o "$out" --ranks 4 \
    --only "${PBS_ARRAY_INDEX:?submit it with -J}" -- --walltime 4:00:00 --walltime-margin 5m
