#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "pointflight/render/internal/beam_kernel.hpp"

namespace pointflight {

/// Sums for each word of a map, of several kinds, added to from several threads. Whole numbers of
/// 2^-20: their sums do not depend on the order of adding.
class SurfelEvidence {
 public:
  /// All zero.
  SurfelEvidence(std::size_t words, std::size_t kinds)
      : kinds_(kinds), sums_(new std::atomic<std::int64_t>[words * kinds]()) {}

  /// A hit's weight in steps of kWeightOne.
  void add(std::size_t word, std::size_t kind, std::int32_t weight) {
    sums_[word * kinds_ + kind].fetch_add(weight, std::memory_order_relaxed);
  }
  /// A finite number, rounded to 2^-20.
  void add(std::size_t word, std::size_t kind, double value) {
    sums_[word * kinds_ + kind].fetch_add(
        static_cast<std::int64_t>(value * static_cast<double>(kWeightOne)),
        std::memory_order_relaxed);
  }
  /// Of one kind.
  [[nodiscard]] double sum(std::size_t word, std::size_t kind) const {
    return static_cast<double>(sums_[word * kinds_ + kind].load(std::memory_order_relaxed)) /
           static_cast<double>(kWeightOne);
  }

 private:
  std::size_t kinds_;
  std::unique_ptr<std::atomic<std::int64_t>[]> sums_;
};

}  // namespace pointflight
