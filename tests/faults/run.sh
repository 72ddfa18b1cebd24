#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Lets every call fail once, one after the other, and sends signals at 100 moments each: about two
# hours. With numbers, at so many places of each kind and at so many moments:
#   tests/faults/run.sh [PLACES [MOMENTS]]
set -eu
cd "$(dirname "$0")/../.."

cmake --preset dev -DMONO3D_UNITY_BUILD=ON
cmake --build --preset dev --target mono3d_faults_test
# Lines of its tables: kind, calls in a whole run, of these failed in turn, ended in order, of these
# with exit status 0.
MONO3D_FAULTS_PER_KIND=${1:-0} MONO3D_SIGNAL_MOMENTS=${2:-100} \
  build/dev/tests/faults/mono3d_faults_test
