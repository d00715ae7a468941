#!/usr/bin/env bash
# Installs everything Brisance needs on Debian 12 or newer, or Ubuntu 24.04 or newer, and nothing
# outside apt and the checkout's own .venv. Run it as often as you like: it does only what is missing.
#   apt:  MPI, PETSc, SLEPc and the parallel HDF5, one build that fits together, with their numpy
#   PyPI: the exact versions of runs/requirements.txt
# With --from-source it makes a second environment, .venv-source, in which a newer PETSc and SLEPc are
# built from their sources on PyPI (runs/petsc.sh; PETSc alone takes nine minutes of one core).
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
venv=$root/.venv
pins=$root/runs/requirements.txt
base=/usr/bin/python3   # Debian's, for which apt's modules are built; not another python3 on PATH
debian=(python3-venv python3-numpy python3-petsc4py python3-slepc4py python3-mpi4py
        python3-mpi4py-fft python3-h5py-mpi openmpi-bin)
from_source=
case "${*:-}" in
"") ;;
--from-source)
    from_source=3.26.1
    venv=$root/.venv-source
    debian=(python3-venv python3-numpy python3-mpi4py python3-mpi4py-fft python3-h5py-mpi openmpi-bin
            python3-dev libopenmpi-dev liblapack-dev gcc make) ;;
*) echo "setup: $*: unknown; fix: no argument, or --from-source" >&2; exit 2 ;;
esac
unset PYTHONHOME PYTHONPATH

say() { echo "setup: $*"; }
fail() { echo "setup: $*" >&2; exit 1; }

# The line of a log that explains a failure.
reason() { echo "$(grep -m1 -E "$1" "$2" || tail -n1 "$2") (log: $2)"; }

installed_debian() {
    dpkg-query -W -f '${db:Status-Abbrev} ${Package} ${Version}\n' "${debian[@]}" 2>/dev/null || true
}

# What the finished environment was made from; it is up to date while this stays the same.
fingerprint() {
    { cat "$root/runs/setup.sh" "$root/runs/petsc.sh" "$pins"; echo "$root"; installed_debian; } | sha256sum
}

install_debian() {
    local have missing=() as_root=() log
    have=$(installed_debian)
    for package in "${debian[@]}"; do
        grep -q "^ii  *$package " <<<"$have" || missing+=("$package")
    done
    if [ ${#missing[@]} -eq 0 ]; then return; fi
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || fail "needs root to install ${missing[*]}: run as root, or install sudo"
        sudo -v || fail "sudo was refused; ask an administrator for: apt-get install ${missing[*]}"
        as_root=(sudo)
    fi
    say "installing from apt: ${missing[*]}"
    log=$(mktemp)
    "${as_root[@]}" apt-get update >"$log" 2>&1 ||
        say "apt-get update failed; trying with the package lists at hand"
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y --no-install-recommends "${missing[@]}" >>"$log" 2>&1 ||
        fail "apt-get could not install them: $(reason '^W: Failed to fetch|^E:' "$log")"
    rm -f "$log"
}

make_venv() {
    local version
    version=$("$base" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    "$base" -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
        fail "$base is Python $version, 3.11 or newer is needed: use Debian 12, Ubuntu 24.04 or newer"
    # A moved checkout or a new system Python leaves an environment that points to the old one.
    if [ "$(cat "$venv/made-for" 2>/dev/null)" != "$root $version" ]; then
        say "making $(basename "$venv") on $base (Python $version)"
        "$base" -m venv --clear --system-site-packages "$venv" || fail "python3 -m venv could not make $venv"
        echo "$root $version" >"$venv/made-for"
    fi
}

install_pypi() {
    local log
    log=$(mktemp)
    say "installing $(grep -c == "$pins") packages from PyPI"
    "$venv/bin/python" -m pip install --disable-pip-version-check --no-deps \
        --only-binary :all: -r "$pins" >"$log" 2>&1 ||
        fail "pip could not install runs/requirements.txt: $(reason 'connection broken|^ERROR' "$log")"
    rm -f "$log"
}

build_petsc() {
    local log
    log=$(mktemp)
    say "building PETSc and SLEPc $from_source (log: $log)"
    bash "$root/runs/petsc.sh" "$venv" "$from_source" >"$log" 2>&1 ||
        fail "they could not be built: $(reason 'rror:|\*\*\*' "$log")"
    rm -f "$log"
}

# Read at every start of .venv's Python: the checkout is importable from any directory, PETSc and
# SLEPc are found, and packages in ~/.local (another numpy, say) do not come before the system's.
write_site() {
    local petsc slepc site
    site=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
    petsc=$site/petsc slepc=$site/slepc
    if [ -z "$from_source" ]; then
        petsc=$(ls -d /usr/lib/petscdir/petsc*/*-real | sort -V | tail -n1) ||
            fail "no real-valued PETSc under /usr/lib/petscdir"
        slepc=$(ls -d /usr/lib/slepcdir/slepc*/*-real | sort -V | tail -n1) ||
            fail "no real-valued SLEPc under /usr/lib/slepcdir"
    fi
    cat >"$site/brisance.pth" <<PTH
$root
import os; os.environ.setdefault("PETSC_DIR", "$petsc")
import os; os.environ.setdefault("SLEPC_DIR", "$slepc")
import site; site.ENABLE_USER_SITE = False
PTH
    if ! grep -q OMPI_ALLOW_RUN_AS_ROOT "$venv/bin/activate"; then
        cat >>"$venv/bin/activate" <<'ACTIVATE'

# mpirun refuses to start as root, the usual user in a container, unless told twice
if [ "$(id -u)" -eq 0 ]; then
    export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
fi
ACTIVATE
    fi
}

# Everything must load into one process, and h5py under mpirun must be the parallel build.
probe() {
    say "checking that everything loads together"
    "$venv/bin/python" - <<'PROBE' || fail "the installed packages do not load together (the reason is above)"
import numpy
assert numpy.__file__.startswith("/usr/lib/"), (
    f"numpy {numpy.__version__} from {numpy.__file__} hides Debian's: uninstall it there")
import petsc4py.PETSc, slepc4py.SLEPc, mpi4py.MPI, mpi4py_fft, h5py
import numba, llvmlite.ir, ducc0.fft, scipy.sparse, scipy.spatial, pydantic, numexpr, meshio, trimesh, embreex
import colour, PIL.Image, OpenEXR, av, matplotlib, rich, pytest, hypothesis
PROBE
    (
        # shellcheck disable=SC1091
        source "$venv/bin/activate"
        mpirun --oversubscribe -n 2 python -c \
            'import h5py; assert h5py.get_config().mpi, "h5py is not the parallel build"'
    ) || fail "mpirun -n 2 does not work here (the reason is above)"
}

# numba keeps compiled kernels beside the code and does not notice when a function that a kernel
# calls changes in another file; so all are compiled anew whenever the code has changed.
compile_kernels() {
    local code packages=("$root/solver" "$root/partition" "$root/render")
    code=$(find "${packages[@]}" -name '*.py' -print0 | sort -z | xargs -0 cat | sha256sum)
    if cat "$root"/.venv*/kernels 2>/dev/null | grep -qxF "$code"; then return; fi
    say "compiling the kernels of this version"
    rm -f "$root"/.venv*/kernels   # both environments use the same
    find "${packages[@]}" -name '*.nb[ic]' -delete
    (cd "$root" && "$venv/bin/python" -m runs.warm) ||
        fail "a kernel does not compile (the reason is above)"
    echo "$code" >"$venv/kernels"
}

exec 9<"$root/runs/setup.sh"
flock 9   # a second set-up waits for the first
command -v apt-get >/dev/null || fail "needs Debian or Ubuntu: apt-get was not found"
if [ -x "$venv/bin/python" ] && [ "$(cat "$venv/up-to-date" 2>/dev/null)" = "$(fingerprint)" ]; then
    compile_kernels
    say "$(basename "$venv") is up to date"
    exit 0
fi
install_debian
make_venv
install_pypi
if [ -n "$from_source" ]; then build_petsc; fi
write_site
probe
fingerprint >"$venv/up-to-date"
compile_kernels
say "done: source $(basename "$venv")/bin/activate, or call $(basename "$venv")/bin/python"
