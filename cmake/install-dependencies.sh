#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Installs what mono3d needs on Debian 12. Needs root or sudo, and the network, only when something
# is missing.
#   cmake/install-dependencies.sh product  what building, installing and running the library and the tools takes
#   cmake/install-dependencies.sh          also what only developers need: tests, checkers, documentation
set -eu

# OpenCV whole: Debian's libopencv-dev alone has its CMake package, which wants every module.
product="
  ca-certificates
  g++ cmake ninja-build pkg-config dpkg-dev file
  libeigen3-dev libopencv-dev libceres-dev nlohmann-json3-dev libopenexr-dev libyaml-cpp-dev
  libproj-dev libgdal-dev
  libjpeg-dev libpng-dev libheif-dev
  libexif-dev libexpat1-dev libflann-dev libembree-dev
  libtinygltf-dev libmeshoptimizer-dev
  libavcodec-dev libavformat-dev libavutil-dev libswscale-dev
  libvulkan-dev mesa-vulkan-drivers glslang-tools libspirv-cross-c-shared-dev
  libcli11-dev libspdlog-dev libcpp-httplib-dev
"
developers="
  git
  libgtest-dev libgmock-dev chromium
  ffmpeg python3-gi gir1.2-gst-rtsp-server-1.0 gstreamer1.0-plugins-good
  vulkan-validationlayers
  clang clang-format clang-tidy libclang-rt-dev doxygen
"
case ${1:-all} in
  product) packages=$product ;;
  all) packages="$product $developers" ;;
  *)
    echo "install-dependencies.sh: expected nothing or \"product\", found \"$1\"" >&2
    exit 2 ;;
esac

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
