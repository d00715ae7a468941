#!/usr/bin/env bash
# A second environment, .venv-ecosystem, with the programs that open our files: for
# `python -m solver.results convert`, for solver/results/reading.py and for tests/run.sh --ecosystem.
# It holds no MPI and no PETSc, and another h5py and numpy than .venv: neither disturbs the other.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
venv=$root/.venv-ecosystem
pins=$root/runs/requirements-ecosystem.txt
unset PYTHONHOME PYTHONPATH

say() { echo "ecosystem: $*"; }
fail() { echo "ecosystem: $*" >&2; exit 1; }

exec 9<"$pins"
flock 9   # a second set-up waits for the first
state=$({ cat "$pins" "${BASH_SOURCE[0]}"; echo "$root"; } | sha256sum)
if [ "$(cat "$venv/up-to-date" 2>/dev/null)" = "$state" ]; then say "up to date"; exit 0; fi

# OpenVDB for Python comes from apt only; without it everything but --to vdb works.
module() { find /usr/lib/python3/dist-packages -name 'pyopenvdb*.so' 2>/dev/null | head -n1; }
if [ -z "$(module)" ]; then
    as_root=(); [ "$(id -u)" -eq 0 ] || as_root=(sudo -n)
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends \
        python3-openvdb >/dev/null 2>&1 || say "no python3-openvdb: --to vdb will not work"
fi

say "installing $(grep -c == "$pins") packages from PyPI (about 2 GB, most of it Blender)"
/usr/bin/python3 -m venv --clear "$venv" || fail "python3 -m venv could not make $venv"
log=$(mktemp)
"$venv/bin/python" -m pip install --disable-pip-version-check --no-deps --only-binary :all: \
    -r "$pins" >"$log" 2>&1 || fail "pip failed: $(grep -m1 '^ERROR' "$log" || tail -n1 "$log") (log: $log)"
rm -f "$log"

site=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
echo "$root" >"$site/brisance.pth"
if [ -n "$(module)" ]; then ln -sf "$(module)" "$site/"; fi
"$venv/bin/python" -c 'import h5py, xarray, pandas, pyvista, vtk, trimesh, pxr.Usd, openpmd_viewer' ||
    fail "what was installed does not load (the reason is above)"
echo "$state" >"$venv/up-to-date"
say "done: .venv-ecosystem/bin/python -m solver.results --help"
