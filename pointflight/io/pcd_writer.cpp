#include "pointflight/io/pcd_writer.hpp"

#include <fmt/format.h>

#include <utility>

#include "pointflight/core/argument.hpp"

namespace pointflight {

void write_pcd(OutputFile file,
               const std::vector<PcdField>& fields,
               std::size_t points,
               std::span<const std::byte> rows) {
  std::size_t row = 0;
  for (const PcdField& field : fields) row += field.size;
  require_argument(rows.size() == points * row, "write_pcd: rows of all fields are wanted");
  std::string names;
  std::string sizes;
  std::string types;
  std::string counts;
  for (const PcdField& field : fields) {
    names += " " + field.name;
    sizes += fmt::format(" {}", field.size);
    types += fmt::format(" {}", field.type);
    counts += " 1";
  }
  file.write(
      fmt::format("# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS{}\nSIZE{}\n"
                  "TYPE{}\nCOUNT{}\nWIDTH {}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\n"
                  "DATA binary\n",
                  names,
                  sizes,
                  types,
                  counts,
                  points,
                  points));
  file.write(rows);
  file.commit();
}

void write_cloud_pcd(OutputFile file, const std::vector<CloudPoint>& points, bool with_intensity) {
  constexpr double kFloatIsExactEnough = 4096.0;  // a float's step is below 0.5 mm up to here
  bool near_origin = true;
  for (const CloudPoint& point : points) {
    near_origin = near_origin && point.position.cwiseAbs().maxCoeff() < kFloatIsExactEnough;
  }
  std::vector<std::byte> rows;
  const auto append = [&rows](const auto& value) {
    const auto* bytes = reinterpret_cast<const std::byte*>(&value);
    rows.insert(rows.end(), bytes, bytes + sizeof(value));
  };
  for (const CloudPoint& point : points) {
    for (int axis = 0; axis < 3; ++axis) {
      if (near_origin) {
        append(static_cast<float>(point.position[axis]));
      } else {
        append(point.position[axis]);
      }
    }
    if (with_intensity) append(point.intensity);
  }
  const std::size_t size = near_origin ? 4 : 8;
  std::vector<PcdField> fields = {{"x", 'F', size}, {"y", 'F', size}, {"z", 'F', size}};
  if (with_intensity) fields.push_back({"intensity", 'F', 4});
  write_pcd(std::move(file), fields, points.size(), rows);
}

}  // namespace pointflight
