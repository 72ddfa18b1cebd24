// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The main function of every test program: testing::TempDir() is a folder of this process alone,
// gone when the process ends. Tests of one program run side by side as processes of their own
// (ctest -j), and two builds of the project may be tested at once: a name of a file is then used
// several times. A child that a test starts of its own program, which may not return, has its
// folder in that of its parent.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#ifdef __SANITIZE_ADDRESS__
// Keeps libraries in memory to the end: what a Vulkan driver keeps for all its instances is a leak
// to LeakSanitizer once the driver is gone, in an unknown module that no suppression names.
extern "C" int dlclose(void* /*library*/) noexcept { return 0; }
#endif

int main(int argc, char** argv) {
  testing::InitGoogleMock(&argc, argv);
  std::string folder = (std::filesystem::path(testing::TempDir()) / "mono3d_test_XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) {
    std::perror(folder.c_str());
    return 1;
  }
  setenv("TEST_TMPDIR", folder.c_str(), 1);
  const int result = RUN_ALL_TESTS();
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
  return result;
}
