#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/internal/column_names.hpp"
#include "pointflight/io/internal/mesh_triangles.hpp"
#include "pointflight/io/internal/ply_rows.hpp"

namespace pointflight {
namespace {

constexpr std::uint64_t kReportVertices = 65536;  // vertices

class PlyTriangles : public MeshTriangles {
 public:
  PlyTriangles(MappedFile file, const Progress& progress)
      : file_(std::move(file)), header_(parse_ply_header(file_)), rows_(file_, header_) {
    read_vertices(progress);
    restart();
  }

  bool next(Triangle& triangle) override {
    while (waiting_.empty()) {
      if (!read_face()) return false;
    }
    triangle = waiting_.front();
    waiting_.pop_front();
    return true;
  }

  void restart() override {
    rows_ = PlyRows(file_, header_);
    element_ = 0;
    row_ = 0;
    waiting_.clear();
  }

  [[nodiscard]] double share_read() const override {
    return static_cast<double>(rows_.offset()) / static_cast<double>(file_.bytes().size());
  }
  [[nodiscard]] bool is_single_precision() const override { return is_single_; }
  [[nodiscard]] std::optional<FileUnit> unit() const override { return header_.unit; }

 private:
  void read_vertices(const Progress& progress) {
    const std::size_t number = vertex_element(header_, file_.path());
    const PlyElement& vertex = header_.elements[number];
    std::vector<std::string> names;
    for (const PlyProperty& property : vertex.properties) {
      names.push_back(property.count_type ? std::string() : property.name);
    }
    const NamedColumns columns(names);
    if (!columns.has_position()) {
      throw InputError(fmt::format("{}: the 'vertex' element lacks x, y or z", file_.path()));
    }
    const std::array<std::size_t, 3> position = {
        columns.at(ColumnRole::kX), columns.at(ColumnRole::kY), columns.at(ColumnRole::kZ)};
    is_single_ = !header_.ascii && vertex.properties[position[0]].type == PlyScalar::kFloat;
    for (std::size_t i = 0; i < number; ++i) rows_.skip(header_.elements[i]);
    for (std::uint64_t i = 0; i < vertex.count; ++i) {
      rows_.read(vertex, values_, list_);
      if (i % kReportVertices == 0) report(progress, "reading the mesh", share_read());
      vertices_.emplace_back(values_[position[0]], values_[position[1]], values_[position[2]]);
    }
  }

  /// The list of a face's or a strip's corners: by its name, or the only one.
  [[nodiscard]] std::size_t corners_of(const PlyElement& element) const {
    std::size_t only = kNoList;
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      if (!property.count_type) continue;
      if (property.name == "vertex_indices" || property.name == "vertex_index") return i;
      if (only == kNoList) only = i;
    }
    if (only == kNoList) {
      throw InputError(fmt::format("{}: the '{}' element has no list of vertices (vertex_indices)",
                                   file_.path(),
                                   element.name));
    }
    return only;
  }

  /// Reads rows until one has corners; false at the end.
  bool read_face() {
    while (element_ < header_.elements.size()) {
      const PlyElement& element = header_.elements[element_];
      const bool is_strip = element.name == "tristrips";
      if (element.name != "face" && !is_strip) {
        rows_.skip(element);
      } else if (row_ < element.count) {
        if (row_ == 0) list_column_ = corners_of(element);
        rows_.read(element, values_, list_, list_column_);
        ++row_;
        if (is_strip) {
          take_strip();
        } else {
          take_face();
        }
        return true;
      }
      ++element_;
      row_ = 0;
    }
    return false;
  }

  [[nodiscard]] const Vector3d& vertex(double index) const {
    if (index >= 0.0 && index < static_cast<double>(vertices_.size()) &&
        index == std::floor(index)) {
      return vertices_[static_cast<std::size_t>(index)];
    }
    throw InputError(fmt::format(
        "{}: a face names vertex {}, the file has {}", rows_.location(), index, vertices_.size()));
  }

  void take_face() {
    corners_.clear();
    for (const double index : list_) corners_.push_back(vertex(index));
    for (const auto& [a, b, c] : triangulated(corners_)) {
      waiting_.push_back({corners_[a], corners_[b], corners_[c]});
    }
  }

  /// Each corner from the third on makes a triangle with the two before it; -1 begins a new strip.
  void take_strip() {
    std::size_t first = 0;
    for (std::size_t i = 0; i < list_.size(); ++i) {
      if (list_[i] == -1.0) {
        first = i + 1;
        continue;
      }
      const Vector3d& corner = vertex(list_[i]);
      if (i < first + 2) continue;
      waiting_.push_back({vertex(list_[i - 2]), vertex(list_[i - 1]), corner});
    }
  }

  MappedFile file_;
  PlyHeader header_;
  PlyRows rows_;
  std::vector<Vector3d> vertices_;
  bool is_single_ = false;
  std::size_t element_ = 0;
  std::uint64_t row_ = 0;  // of the element, the next one
  std::size_t list_column_ = 0;
  std::deque<Triangle> waiting_;  // of the row that was read last
  std::vector<double> values_;
  std::vector<double> list_;
  std::vector<Vector3d> corners_;
};

}  // namespace

std::unique_ptr<MeshTriangles> ply_triangles(MappedFile file, const Progress& progress) {
  return std::make_unique<PlyTriangles>(std::move(file), progress);
}

}  // namespace pointflight
