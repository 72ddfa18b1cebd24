// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace mono3d::tools {

// Keeps between N / 2 and N elements of a sequence whose length is not known, at equal distances:
// when it is full, every second one goes, and of those to come only every second one is taken.
template <typename Element>
class EvenSample {
 public:
  explicit EvenSample(std::size_t max_size) : max_size_(max_size) {}

  // Counts the element that comes next; to be followed by Add where it is true.
  bool TakesNext() { return num_seen_++ % step_ == 0; }

  void Add(Element element) {
    elements_.push_back(std::move(element));
    if (elements_.size() < max_size_) return;
    std::size_t num_kept = 0;
    for (std::size_t i = 0; i < elements_.size(); i += 2) {
      if (num_kept != i) elements_[num_kept] = std::move(elements_[i]);
      ++num_kept;
    }
    elements_.resize(num_kept);
    step_ *= 2;
  }

  const std::vector<Element>& elements() const { return elements_; }

  // How it came so far: with `elements`, all that another one needs to go on as this one.
  std::int64_t step() const { return step_; }
  std::int64_t num_seen() const { return num_seen_; }
  void Restore(std::vector<Element> elements, std::int64_t step, std::int64_t num_seen) {
    elements_ = std::move(elements);
    step_ = std::max<std::int64_t>(step, 1);
    num_seen_ = num_seen;
  }

 private:
  std::size_t max_size_;
  std::int64_t step_ = 1;
  std::int64_t num_seen_ = 0;
  std::vector<Element> elements_;
};

}  // namespace mono3d::tools
