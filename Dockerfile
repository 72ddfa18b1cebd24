# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# The tools of mono3d in a container:
#   docker build -t mono3d .
#   docker run --rm -u "$(id -u):$(id -g)" -v "$PWD:/data" mono3d mono3d-reconstruct flight.mp4 -o model
# They run on the CPU. For the GPU give the container its driver and device, for Intel and AMD: --device /dev/dri.

FROM debian:bookworm-slim AS build
WORKDIR /mono3d
# First what seldom changes, so that it is not made again.
COPY cmake/install-dependencies.sh cmake/
RUN cmake/install-dependencies.sh product
COPY . .
RUN cmake --workflow --preset package

FROM debian:bookworm-slim
COPY --from=build /mono3d/build/package/libmono3d0.*.deb /mono3d/build/package/mono3d-tools_*.deb /packages/
RUN apt-get update \
  && apt-get install -y --no-install-recommends /packages/*.deb \
  && rm -r /packages /var/lib/apt/lists/*
# Compiled shaders are kept there; any user may write.
ENV XDG_CACHE_HOME=/tmp
WORKDIR /data
CMD ["mono3d-reconstruct", "--help"]
