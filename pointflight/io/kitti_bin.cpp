#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/formats.hpp"

// KITTI's development kit, "velodyne_points": float32 x y z reflectance, no header; nuScenes writes
// the ring as a fifth number.
namespace pointflight {
namespace {

constexpr std::size_t kKitti = 4;  // numbers of a point
constexpr std::size_t kNuScenes = 5;
constexpr std::size_t kGuessedFrom = 1000;  // points that tell what a file is

/// -1 if it is none.
std::int32_t kitti_ring(float value) {
  return value >= 0.0f && value < 65536.0f ? static_cast<std::int32_t>(value) : -1;
}

class KittiReader : public CloudReader {
 public:
  explicit KittiReader(MappedFile file) : file_(std::move(file)), numbers_(numbers_of_a_point()) {
    points_ = file_.bytes().size() / row();
    file_.will_read_sequentially();
  }

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    rings_.clear();
    for (; batch.size() < kBatch && next_ < points_; ++next_) {
      CloudPoint& point = batch.emplace_back();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        point.position[static_cast<int>(axis)] = static_cast<double>(number(next_, axis, numbers_));
      }
      point.intensity = number(next_, 3, numbers_);
      if (numbers_ == kNuScenes) rings_.push_back(kitti_ring(number(next_, 4, numbers_)));
    }
    file_.release_before(next_ * row());
    return !batch.empty();
  }

  [[nodiscard]] bool has_intensity() const override { return true; }
  [[nodiscard]] std::span<const std::int32_t> rings() const override { return rings_; }
  [[nodiscard]] FileColumns columns() const override {
    FileColumns columns;
    columns.intensity = "intensity";
    columns.notes.push_back(fmt::format("read as KITTI's float32 x y z intensity{}",
                                        numbers_ == kNuScenes ? " ring (nuScenes)" : ""));
    return columns;
  }
  [[nodiscard]] double share_read() const override {
    return static_cast<double>(next_) / static_cast<double>(points_);
  }

 private:
  [[nodiscard]] std::size_t row() const { return numbers_ * sizeof(float); }
  [[nodiscard]] float number(std::size_t point, std::size_t column, std::size_t numbers) const {
    return load<float>(file_.bytes().data() + (point * numbers + column) * sizeof(float));
  }

  /// Positions of LiDARs' points, and rings if there are some; NaN may be among them.
  [[nodiscard]] bool is_plausible(std::size_t numbers) const {
    constexpr float kFarthest = 1e5f;  // m
    const std::size_t points = file_.bytes().size() / (numbers * sizeof(float));
    if (points * numbers * sizeof(float) != file_.bytes().size()) return false;
    const std::size_t stride = std::max<std::size_t>(1, points / kGuessedFrom);
    std::size_t off_zero = 0;
    for (std::size_t i = 0; i < points; i += stride) {
      for (std::size_t column = 0; column < 3; ++column) {
        const float value = number(i, column, numbers);
        if (std::abs(value) > kFarthest) return false;
        off_zero += std::abs(value) > 1e-3f ? 1 : 0;  // bytes of something else make tiny floats
      }
      const float ring = numbers == kNuScenes ? number(i, 4, numbers) : 0.0f;
      if (!(ring >= 0.0f && ring < 256.0f && ring == std::floor(ring))) return false;
    }
    return off_zero > 0;
  }

  [[nodiscard]] std::size_t numbers_of_a_point() const {
    for (const std::size_t numbers : {kNuScenes, kKitti}) {
      if (is_plausible(numbers)) return numbers;
    }
    throw InputError(
        fmt::format("{}: does not look like KITTI's points (float32 x y z intensity, {} bytes of "
                    "which are no whole number of points or no positions); save it as PCD or PLY",
                    file_.path(),
                    file_.bytes().size()));
  }

  MappedFile file_;
  std::size_t numbers_;
  std::size_t points_ = 0;
  std::size_t next_ = 0;
  std::vector<std::int32_t> rings_;
};

}  // namespace

std::unique_ptr<CloudReader> open_kitti_bin(MappedFile file) {
  return std::make_unique<KittiReader>(std::move(file));
}

}  // namespace pointflight
