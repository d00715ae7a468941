#!/usr/bin/env bash
# A run as a SLURM job that goes on in as many jobs as it needs:
#   sbatch runs/jobs/slurm.sh runs/scenes/window.toml out/window
# Five minutes before the limit SLURM signals this script, the solver saves a checkpoint and exits
# with 85, and the job is put into the queue again; it continues from the newest good checkpoint.
#SBATCH --job-name=brisance
#SBATCH --ntasks=16
#SBATCH --cpus-per-task=1
#SBATCH --time=04:00:00
#SBATCH --signal=B:USR1@300
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=%x-%j.log
set -u
scene=$1 out=$2
shift 2

# shellcheck disable=SC1091
source .venv/bin/activate
mpirun --bind-to core ${SLURM_NTASKS:+-n "$SLURM_NTASKS"} \
    python -m solver "$scene" -o "$out" --restart "$@" &
solver=$!
trap 'kill -USR1 $solver' USR1 TERM
code=0
while kill -0 $solver 2>/dev/null; do   # a signal ends `wait` early
    wait $solver
    code=$?
done
if [ $code -eq 85 ]; then
    if [ -n "${SLURM_JOB_ID:-}" ]; then scontrol requeue "$SLURM_JOB_ID"; fi
fi
exit $code
