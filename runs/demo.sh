#!/usr/bin/env bash
# An explosion breaks a window: installs what is missing, then makes out/window/window.mp4.
# Options are passed on to `python -m runs window`, for instance --tiny or --ranks 4.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
bash runs/setup.sh
.venv/bin/python -m runs window "$@"
