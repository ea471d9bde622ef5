#pragma once

#include <utility>
#include <vector>

#include "pointflight/io/cloud_reader.hpp"

namespace pointflight {

/// Points already in memory as a cloud.
class MemoryCloud : public CloudReader {
 public:
  explicit MemoryCloud(std::vector<CloudPoint> points) : points_(std::move(points)) {}
  bool read(std::vector<CloudPoint>& batch) override {
    batch = std::move(points_);
    points_.clear();
    return !batch.empty();
  }
  [[nodiscard]] bool has_intensity() const override { return true; }
  [[nodiscard]] double share_read() const override { return 1.0; }

 private:
  std::vector<CloudPoint> points_;
};

}  // namespace pointflight
