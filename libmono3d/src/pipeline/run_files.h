// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace mono3d {

// The names of what a run writes into its folder.

inline constexpr std::array kTrajectoryNames = {"trajectory", "trajectory_online", "keyframes",
                                                "model_trajectory"};
inline constexpr std::array<std::string_view, 13> kDepthEndings = {
    ".depth.pfm",      ".depth.exr",        ".depth16.png",   ".depth.png",    ".normal.pfm",
    ".normal.exr",     ".normal16.png",     ".normal.png",    ".inferred.png", ".confidence.pfm",
    ".confidence.exr", ".confidence16.png", ".confidence.png"};
inline constexpr std::string_view kDepthScaleName = "scale.txt";  // of .depth16.png
inline constexpr std::string_view kDepthFolder = "depth";
inline constexpr std::string_view kDepthCameraName = "camera.yaml";
inline constexpr std::string_view kKeyframeImageFolder = "images_global_shutter";
inline constexpr std::string_view kCameraName = "learned_camera.yaml";

// "trajectory.txt" for the first map, "trajectory_map3.txt" for a further one.
std::string NameOfMap(const std::string& stem, const std::string& extension, bool is_first,
                      int map_id);
// "learned_camera_2.yaml"
std::string NameOfCamera(std::size_t number);
// "000042", with kDepthEndings behind.
std::string DepthMapName(std::int64_t frame_index);

// The files of a run in the folder, and what was left of them half written, by their paths below
// it. A folder that is not there has none. Throws Error (kIo) where one cannot be read.
std::vector<std::filesystem::path> FilesOfRun(const std::filesystem::path& folder);

// Removes them, and the folders below with nothing else in them. Throws Error (kIo).
void RemoveRun(const std::filesystem::path& folder);

// One file of a run, where it is there. Throws Error (kIo).
void RemoveRunFile(const std::filesystem::path& file);

}  // namespace mono3d
