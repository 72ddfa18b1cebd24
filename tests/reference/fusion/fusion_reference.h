// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fusion/anchor_table.h"
#include "fusion/depth_map_buffers.h"
#include "fusion/exposure.h"
#include "fusion/register.params.h"
#include "fusion/registration/system.h"
#include "fusion/selection.h"
#include "fusion/surfel.h"
#include "fusion/view.params.h"

// The stages of fusion without a device, one loop each. Arrays as the stages have them.
namespace mono3d::reference {

using Candidates = std::vector<std::array<float, 4>>;  // per pixel: normal in camera, confidence

struct IndexCell {
  std::uint32_t surfel = 0xFFFFFFFFU;
  std::uint32_t depth_bits = 0xFFFFFFFFU;
  bool operator==(const IndexCell&) const = default;
};

// Per anchor of the model, as the camera has it.
using AnchorTransforms = std::vector<AnchorTransform>;

Candidates Prepare(const ViewParams& view, const PackedDepthMap& map);

std::vector<std::uint32_t> Associate(const ViewParams& view, const AnchorTransforms& anchors,
                                     const PackedDepthMap& map, const Candidates& candidates,
                                     const Surfels& surfels);

std::vector<IndexCell> DrawIndexMap(const ViewParams& view, const AnchorTransforms& anchors,
                                    const Surfels& surfels,
                                    const std::vector<std::uint32_t>& association);

std::vector<std::uint32_t> SelectNew(const ViewParams& view, const AnchorTransforms& anchors,
                                     const PackedDepthMap& map, const Candidates& candidates,
                                     const std::vector<IndexCell>& index_map,
                                     const Surfels& surfels);

void Merge(const ViewParams& view, const AnchorTransforms& anchors, const PackedDepthMap& map,
           const Candidates& candidates, const std::vector<std::uint32_t>& association,
           Surfels& surfels);

// Returns the number of surfels removed.
std::uint32_t ClearFreeSpace(const ViewParams& view, const std::vector<std::uint32_t>& association,
                             Surfels& surfels);

// Returns the number of surfels removed.
std::uint32_t GiveWay(const std::vector<std::uint32_t>& association, Surfels& surfels);

// Appends a surfel for each selected pixel, anchored to the depth map.
void Insert(const ViewParams& view, const PackedDepthMap& map, const Candidates& candidates,
            const std::vector<std::uint32_t>& selected, Surfels& surfels);

// What image and model say of the brightness of the same places, per cell of the image.
std::vector<ExposureCell> ExposureCells(const ViewParams& view, const PackedDepthMap& map,
                                        const std::vector<std::uint32_t>& association,
                                        const Surfels& surfels);

// The normal equations of a registration, in double precision, with derivatives by central
// differences. `grey`: rows of the level's width, floor(size / 2^level).
RegistrationSystem Register(const RegisterParams& params, const AnchorTransforms& anchors,
                            const PackedDepthMap& map, const Candidates& candidates,
                            const Surfels& surfels, const std::vector<float>& grey);

// All of them: one depth map into the model.
void Integrate(const ViewParams& view, const AnchorTransforms& anchors, const PackedDepthMap& map,
               Surfels& surfels);

}  // namespace mono3d::reference
