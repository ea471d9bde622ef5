#include "pointflight/io/tum.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "pointflight/core/mapped_file.hpp"
#include "pointflight/io/byte_cursor.hpp"

namespace pointflight {

std::vector<TumPose> read_tum(const std::string& path) {
  const MappedFile file(path);
  LineCursor lines(as_text(file.bytes()));
  std::vector<TumPose> poses;
  std::string_view line;
  while (lines.next(line)) {
    std::string_view word = take_word(line);
    if (word.empty() || word.front() == '#') continue;
    std::array<double, 8> v{};
    for (double& value : v) {
      if (!parse_number(word, value) || !std::isfinite(value)) {
        throw InputError(
            fmt::format("{}:{}: '{}' is no number; time tx ty tz qx qy qz qw [file] are "
                        "wanted",
                        path,
                        lines.number(),
                        excerpt(word)));
      }
      word = take_word(line);
    }
    const Quaterniond q(v[7], v[4], v[5], v[6]);
    if (std::abs(q.norm() - 1.0) > 0.01) {
      throw InputError(fmt::format("{}:{}: qx qy qz qw have length {:.3f}; a rotation has length 1",
                                   path,
                                   lines.number(),
                                   q.norm()));
    }
    poses.push_back({v[0], {q.normalized(), {v[1], v[2], v[3]}}, std::string(word)});
  }
  if (poses.empty()) throw InputError(fmt::format("{}: no poses", path));
  return poses;
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
