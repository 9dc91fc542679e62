#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# consume.sh FOLDER BUMPS: runs the stranger's programs.
set -euo pipefail
"$1/plan_bumps" "$2"
"$1/step_chip"
"$1/one_profile"
# A profile needs neither OpenCV nor Ceres.
! ldd "$1/one_profile" | grep -E 'opencv|ceres'
