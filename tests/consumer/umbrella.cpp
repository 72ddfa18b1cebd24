// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// All headers at once.

#include <mono3d/mono3d.h>

#include <exception>
#include <iostream>

int main() {
  try {
    if (mono3d::CreateTracker() == nullptr) return 1;
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  std::cout << "mono3d " << mono3d::Version() << '\n';
  return 0;
}
