// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string>

namespace mono3d {

// What people give for images that is not read, and what they can do: for messages.

// Of an input that is no file and no folder: a stream, a camera, or nothing.
struct WhatInsteadOfFile {
  std::string what;
  bool is_unsupported = false;  // else there is no such thing
};
WhatInsteadOfFile ExplainNoFile(const std::string& input);

// Of a file that is not named as an image: false where FFmpeg need not be asked, which takes text
// for pictures of characters.
bool MayBeVideo(const std::filesystem::path& file);
// Why it is none.
std::string ExplainNoVideo(const std::filesystem::path& file);

// By the name alone.
bool IsVideoName(const std::filesystem::path& file);
// Whether videos of this name store how many frames they have; by the name alone.
bool HasStoredFrameCount(const std::filesystem::path& video);
// A photograph of a form that is not read: a raw one.
bool IsOtherPhoto(const std::filesystem::path& file);
// How to come from that form to one that is read.
std::string HowToConvert();

// What is in a folder without images: "24 .dng files (...)", "the folders a (24 images), b".
std::string ExplainNoImages(const std::filesystem::path& folder);

}  // namespace mono3d
