#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/formats.hpp"

// Leica's PTX: scans one after the other, each with columns, rows, the scanner's position and axes
// (4 lines), a 4 x 4 matrix (4 lines, points are rows: p' = p M), then columns * rows lines of x y
// z intensity [red green blue] in the scanner's frame; 0 0 0 is a beam without a return.
namespace pointflight {
namespace {

class PtxReader : public CloudReader {
 public:
  explicit PtxReader(MappedFile file) : file_(std::move(file)), lines_(as_text(file_.bytes())) {
    file_.will_read_sequentially();
  }

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    while (batch.size() < kBatch) {
      if (left_ == 0 && !next_scan()) break;
      read_point(batch);
      --left_;
    }
    file_.release_before(lines_.offset());
    return !batch.empty();
  }

  [[nodiscard]] bool has_intensity() const override { return true; }
  [[nodiscard]] FileColumns columns() const override {
    FileColumns columns;
    columns.intensity = "intensity";
    if (empty_ > 0) {
      columns.notes.push_back(fmt::format("{} beams without a return (0 0 0)", empty_));
    }
    return columns;
  }
  [[nodiscard]] double share_read() const override { return lines_.share(); }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}: {}", file_.path(), lines_.number(), what));
  }

  /// Numbers of the next line that is not blank; false at the end.
  bool next_numbers(std::size_t least, std::size_t most) {
    std::string_view line;
    do {
      if (!lines_.next(line)) return false;
    } while (line.find_first_not_of(" \t") == std::string_view::npos);
    count_ = 0;
    for (auto word = take_word(line); !word.empty(); word = take_word(line)) {
      if (count_ == most) fail(fmt::format("more than {} numbers", most));
      if (!parse_number(word, numbers_[count_++])) {
        fail(fmt::format("'{}' is no number", excerpt(word)));
      }
    }
    if (count_ < least) fail(fmt::format("{} numbers where {} are wanted", count_, least));
    return true;
  }

  void must_have_numbers(std::size_t count) {
    if (!next_numbers(count, count)) fail("the file ends amid a scan's header");
  }

  std::uint64_t size() {
    constexpr double kMost = 1e7;
    if (!(numbers_[0] >= 0.0 && numbers_[0] <= kMost && numbers_[0] == std::floor(numbers_[0]))) {
      fail("a PTX scan begins with its numbers of columns and rows");
    }
    return static_cast<std::uint64_t>(numbers_[0]);
  }

  bool next_scan() {
    while (left_ == 0) {
      if (!next_numbers(1, 1)) return false;
      const std::uint64_t columns = size();
      must_have_numbers(1);
      left_ = columns * size();
      for (int line = 0; line < 4; ++line) must_have_numbers(3);
      for (int row = 0; row < 4; ++row) {
        must_have_numbers(4);
        for (int column = 0; column < 3; ++column) {
          T_world_scan_(column, row) = numbers_[static_cast<std::size_t>(column)];
        }
      }
    }
    return true;
  }

  void read_point(std::vector<CloudPoint>& batch) {
    if (!next_numbers(4, 7)) fail(fmt::format("the file ends, {} points are missing", left_));
    const Vector3d p(numbers_[0], numbers_[1], numbers_[2]);
    if (p.isZero(0.0)) {
      ++empty_;
      return;
    }
    CloudPoint& point = batch.emplace_back();
    point.position = T_world_scan_.leftCols<3>() * p + T_world_scan_.col(3);
    point.intensity = static_cast<float>(numbers_[3]);
  }

  MappedFile file_;
  LineCursor lines_;
  std::array<double, 7> numbers_{};
  std::size_t count_ = 0;  // of them
  Eigen::Matrix<double, 3, 4> T_world_scan_ = Eigen::Matrix<double, 3, 4>::Identity();
  std::uint64_t left_ = 0;  // points of the scan
  std::uint64_t empty_ = 0;
};

}  // namespace

std::unique_ptr<CloudReader> open_ptx(MappedFile file) {
  return std::make_unique<PtxReader>(std::move(file));
}

}  // namespace pointflight
