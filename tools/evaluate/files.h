// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace mono3d::tools {

// The name of a folder, also of one given as "." or with a slash at the end.
std::string NameOfFolder(const std::filesystem::path& folder);

using FilesByFrame = std::map<std::int64_t, std::filesystem::path>;

// The last number in a file's name, before its first point: 7 of "rect_0007.depth.pfm"; nothing
// when there is none.
std::optional<std::int64_t> FrameNumber(const std::filesystem::path& path);

// The files of the folder whose names end in `ending`, by their number; none when there is no such
// folder. Throws Error when two files have the same number.
FilesByFrame ListByFrame(const std::filesystem::path& folder, const std::string& ending);

// The files of depth maps of a run, of one kind (depth, confidence, normal): .pfm, else .exr, else
// PNG of 16 bits; none where there are none.
FilesByFrame ListDepthMapFiles(const std::filesystem::path& folder, const std::string& kind);

// Depth images of a folder: the depth maps of a run where there are some, else *.pfm, *.exr or
// *.png, whichever of these comes first. Throws Error when there are none.
FilesByFrame ListDepthImages(const std::filesystem::path& folder);

// Files of one map of a run; empty where there is no such file.
struct RunMapFiles {
  std::string suffix;  // "" of the first map, "_map3" of a further one
  std::filesystem::path trajectory;
  std::filesystem::path trajectory_online;
  std::filesystem::path model_trajectory;
  std::filesystem::path model;
  std::filesystem::path mesh;
};

// What mono3d-reconstruct wrote into a folder.
struct RunFiles {
  std::vector<RunMapFiles> maps;  // the one with most tracked frames first
  FilesByFrame depth;
  FilesByFrame confidence;
  FilesByFrame normal;
  std::filesystem::path record;  // run.json
};

// Throws Error when the folder holds nothing of a run.
RunFiles FindRunFiles(const std::filesystem::path& folder);

// What there is in the folder of a sequence; empty where it has no such thing.
struct SequenceFiles {
  std::vector<std::string> images;
  std::filesystem::path camera;
  std::filesystem::path groundtruth;
  std::filesystem::path timestamps;
  FilesByFrame depth;
  std::filesystem::path cloud;
};

// Throws Error when the folder is not there or holds no truth at all.
SequenceFiles FindSequenceFiles(const std::filesystem::path& folder);

// The number in the truth's file names for the `index`-th image of the sequence: that in the
// image's name, or the index itself where the names have no numbers.
std::int64_t NumberOfImage(const SequenceFiles& sequence, std::int64_t index);

}  // namespace mono3d::tools
