#!/usr/bin/env bash
# A sweep as an array of SLURM jobs, one run each, each going on in as many jobs as it needs:
#   table=runs/sweep/gas.toml
#   sbatch --array=0-$(($(python -m runs sweep $table --count) - 1)) runs/jobs/slurm_array.sh $table out/gas
# %8 after the range runs 8 at a time. `python -m runs sweep TABLE -o OUT --list` shows the states and
# writes the summary. Submit the same again for what is left: what is done is not run again.
#SBATCH --job-name=brisance-sweep
#SBATCH --ntasks=4
#SBATCH --cpus-per-task=1
#SBATCH --time=04:00:00
#SBATCH --signal=B:USR1@300
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=%x-%A_%a.log
set -u
table=$1 out=$2
shift 2

# shellcheck disable=SC1091
source .venv/bin/activate
python -m runs sweep "$table" -o "$out" --ranks "${SLURM_NTASKS:-2}" \
    --only "${SLURM_ARRAY_TASK_ID:?submit it with --array}" -- "$@" &
sweep=$!
trap 'kill -USR1 $sweep' USR1 TERM
code=0
while kill -0 $sweep 2>/dev/null; do   # a signal ends `wait` early
    wait $sweep
    code=$?
done
if [ $code -eq 85 ] && [ -n "${SLURM_JOB_ID:-}" ]; then scontrol requeue "$SLURM_JOB_ID"; fi
exit $code
