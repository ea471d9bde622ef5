#include "pointflight/io/pose_files.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string_view>

#include "pointflight/core/mapped_file.hpp"
#include "pointflight/io/byte_cursor.hpp"

namespace pointflight {
namespace {

/// Calls `row(numbers, word behind them, location)` for the rows of N numbers that a file has, one
/// at least.
template <std::size_t N, class Row>
void read_rows(const std::string& path, const char* wanted, const Row& row) {
  const MappedFile file(path);
  LineCursor lines(as_text(file.bytes()));
  std::string_view line;
  bool any = false;
  while (lines.next(line)) {
    std::string_view word = take_word(line);
    if (word.empty() || word.front() == '#') continue;
    const std::string location = fmt::format("{}:{}", path, lines.number());
    std::array<double, N> v{};
    for (double& value : v) {
      if (!parse_number(word, value) || !std::isfinite(value)) {
        throw InputError(fmt::format("{}: '{}' is no number; {}", location, excerpt(word), wanted));
      }
      word = take_word(line);
    }
    row(v, word, location);
    any = true;
  }
  if (!any) throw InputError(fmt::format("{}: no poses", path));
}

}  // namespace

std::vector<TumPose> read_tum(const std::string& path) {
  std::vector<TumPose> poses;
  const auto row =
      [&](const std::array<double, 8>& v, std::string_view file, const auto& location) {
        const Quaterniond q(v[7], v[4], v[5], v[6]);
        if (std::abs(q.norm() - 1.0) > 0.01) {
          throw InputError(fmt::format(
              "{}: qx qy qz qw have length {:.3f}; a rotation has length 1", location, q.norm()));
        }
        poses.push_back({v[0], {q.normalized(), {v[1], v[2], v[3]}}, std::string(file)});
      };
  read_rows<8>(path, "time tx ty tz qx qy qz qw [file] are wanted", row);
  return poses;
}

std::vector<Pose> read_kitti(const std::string& path) {
  std::vector<Pose> poses;
  const auto row = [&](const std::array<double, 12>& v, std::string_view, const auto& location) {
    Matrix3d rotation;
    rotation << v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10];
    if (!((rotation * rotation.transpose() - Matrix3d::Identity()).norm() <= 0.01) ||
        !(rotation.determinant() > 0.0)) {
      throw InputError(fmt::format("{}: the first three columns are no rotation", location));
    }
    poses.push_back({Quaterniond(rotation).normalized(), {v[3], v[7], v[11]}});
  };
  read_rows<12>(path, "twelve are wanted (KITTI)", row);
  return poses;
}

bool is_kitti(const std::string& path) {
  const MappedFile file(path);
  LineCursor lines(as_text(file.bytes()));
  std::string_view line;
  while (lines.next(line)) {
    std::size_t words = 0;
    for (auto word = take_word(line); !word.empty(); word = take_word(line)) {
      if (words == 0 && word.front() == '#') break;
      ++words;
    }
    if (words > 0) return words == 12;
  }
  return false;
}

void write_tum(OutputFile file, const std::vector<TumPose>& poses) {
  file.write("# timestamp tx ty tz qx qy qz qw [file] (T_world_sensor)\n");
  for (const TumPose& pose : poses) {
    const Vector3d& p = pose.T_world_sensor.translation;
    const Quaterniond& q = pose.T_world_sensor.rotation;
    file.write(fmt::format("{} {} {} {} {} {} {} {}{}{}\n",
                           pose.time,
                           p.x(),
                           p.y(),
                           p.z(),
                           q.x(),
                           q.y(),
                           q.z(),
                           q.w(),
                           pose.file.empty() ? "" : " ",
                           pose.file));
  }
  file.commit();
}

}  // namespace pointflight
