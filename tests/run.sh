#!/usr/bin/env bash
# Everything that has to hold: style, types, tests on one rank and on two, and the demo at tiny size.
# Stops at the first failure with its exit code.
#   bash tests/run.sh              all of that
#   bash tests/run.sh --from-source  the same with the PETSc and SLEPc of .venv-source
#   bash tests/run.sh --ecosystem  instead: other programs open our files, in .venv-ecosystem
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

heading() { printf '\n=== %s (after %d s)\n' "$1" "$SECONDS"; }
trap 'code=$?; [ $code -eq 0 ] || printf "\n=== FAILED after %d s: exit code %d\n" "$SECONDS" "$code" >&2
      rm -rf "${scratch:-}"' EXIT

heading "set-up"
venv=.venv
if [ "${1:-}" = --from-source ]; then
    venv=.venv-source
    bash runs/setup.sh --from-source
else
    bash runs/setup.sh
fi
# shellcheck disable=SC1090,SC1091
source $venv/bin/activate

if [ "${1:-}" = --ecosystem ]; then
    heading "set-up of .venv-ecosystem"
    bash runs/setup_ecosystem.sh
    heading "other programs open our files"
    .venv-ecosystem/bin/python -m pytest --noconftest tests/test_ecosystem.py
    printf '\n=== all passed in %d s\n' "$SECONDS"
    exit 0
fi

heading "flake8"
flake8

heading "mypy"
mypy

# First on one rank: it also fills numba's cache, which several ranks must not do at the same time.
heading "pytest"
python -m pytest tests

heading "pytest on 2 ranks"
mpirun --oversubscribe -n 2 python -m pytest tests

heading "the demo at tiny size"
scratch=$(mktemp -d)
if [ $venv = .venv ]; then
    bash runs/demo.sh --tiny -o "$scratch/demo"
else
    python -m runs window --tiny -o "$scratch/demo"
fi

printf '\n=== all passed in %d s\n' "$SECONDS"
