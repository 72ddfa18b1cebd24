// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <string_view>

namespace mono3d::fuzz {

// Each hands its input to readers of one kind, in the form that they would meet it in: as a file, a
// folder, a request. They refuse by throwing Error, which ends here; any other exception, and an
// Error while what was read is written and read again, leaves the function.
void Camera(std::string_view input);      // calibrations of every form
void Colmap(std::string_view input);      // cameras.txt, images.txt and points3D.txt, between "---"
void DepthImage(std::string_view input);  // PFM, PNG, OpenEXR
void Export(std::string_view input);      // files of a run, between "======": mono3d-export
void Http(std::string_view input);        // bytes on a connection to the view
void Image(std::string_view input);       // photos, decoded
void LiveAddresses(std::string_view input);  // of cameras that send now
void Options(std::string_view input);        // --config
void Photo(std::string_view input);          // EXIF and XMP
void Ply(std::string_view input);            // clouds, meshes, what the view maps into memory
void Positions(std::string_view input);      // of a drone, in every form
void RunRecord(std::string_view input);      // run.json, sequence.json
void SavedMap(std::string_view input);       // without its checksum, which is added
void Sequence(std::string_view input);       // timestamps.txt, telemetry, names of images
void Trajectory(std::string_view input);     // of every form
// What --resume reads; the input says what is changed in a state that is whole (edits.h).
void SelectorState(std::string_view input);
void StateFolders(std::string_view input);  // files of a journal
void TrackerState(std::string_view input);

struct FuzzTarget {
  std::string_view name;  // of its folder in corpus/ and of its dictionary
  void (*run)(std::string_view input);
};

inline constexpr std::array<FuzzTarget, 18> kFuzzTargets = {{{"camera", Camera},
                                                             {"colmap", Colmap},
                                                             {"depth_image", DepthImage},
                                                             {"export", Export},
                                                             {"http", Http},
                                                             {"image", Image},
                                                             {"live_address", LiveAddresses},
                                                             {"options", Options},
                                                             {"photo", Photo},
                                                             {"ply", Ply},
                                                             {"positions", Positions},
                                                             {"run_record", RunRecord},
                                                             {"saved_map", SavedMap},
                                                             {"selector_state", SelectorState},
                                                             {"sequence", Sequence},
                                                             {"state_folder", StateFolders},
                                                             {"tracker_state", TrackerState},
                                                             {"trajectory", Trajectory}}};

}  // namespace mono3d::fuzz
