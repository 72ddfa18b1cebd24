#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Installs what mono3d needs to build, test and run, on Debian 12. Needs root or sudo, and the
# network, only when something is missing.
set -eu

packages="
  git ca-certificates
  g++ cmake ninja-build pkg-config
  libeigen3-dev libopencv-dev libceres-dev libflann-dev nlohmann-json3-dev libyaml-cpp-dev
  libembree-dev libopenexr-dev
  libvulkan-dev mesa-vulkan-drivers vulkan-validationlayers glslang-tools
  libspirv-cross-c-shared-dev
  libcli11-dev libspdlog-dev libexif-dev
  libgtest-dev libgmock-dev
  clang-format clang-tidy doxygen
"

missing=""
for package in $packages; do
  state=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  [ "$state" = installed ] || missing="$missing $package"
done
[ -n "$missing" ] || exit 0

as_root=""
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null; then
    echo "install-dependencies.sh: not root and no sudo; these packages are missing:$missing" >&2
    exit 1
  fi
  as_root="sudo"
fi

echo "Installing:$missing"
$as_root env DEBIAN_FRONTEND=noninteractive apt-get update
# shellcheck disable=SC2086  # the list is meant to be split
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $missing
