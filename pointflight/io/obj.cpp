#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/file_unit.hpp"
#include "pointflight/io/formats.hpp"
#include "pointflight/io/internal/mesh_triangles.hpp"
#include "pointflight/io/internal/obj_lines.hpp"

namespace pointflight {
namespace {

/// The unit in the first comments.
std::optional<FileUnit> unit_of(const MappedFile& file) {
  constexpr std::size_t kMostLines = 100;
  LineCursor lines(as_text(file.bytes()));
  std::string_view line;
  while (lines.number() < kMostLines && lines.next(line)) {
    if (line.empty() || line.front() != '#') continue;
    if (auto unit = unit_in_comment(line)) return unit;
  }
  return std::nullopt;
}

class ObjTriangles : public MeshTriangles {
 public:
  ObjTriangles(MappedFile file, const Progress& progress) : file_(std::move(file)), lines_(file_) {
    std::string_view keyword;
    std::string_view rest;
    bool ignored = false;
    while (lines_.next(keyword, rest)) {
      if (keyword != "v") continue;
      vertices_.push_back(lines_.vertex(rest, ignored).position);
      if (vertices_.size() % 65536 == 0) report(progress, "reading the mesh", share_read());
    }
    restart();
  }

  bool next(Triangle& triangle) override {
    while (used_ == triangles_.size()) {
      if (!read_face()) return false;
    }
    const auto& [a, b, c] = triangles_[used_++];
    triangle = {corners_[a], corners_[b], corners_[c]};
    return true;
  }

  void restart() override {
    lines_ = ObjLines(file_);
    seen_ = 0;
    used_ = 0;
    triangles_.clear();
  }

  [[nodiscard]] double share_read() const override { return lines_.share(); }
  [[nodiscard]] bool is_single_precision() const override { return false; }
  [[nodiscard]] std::optional<FileUnit> unit() const override { return unit_of(file_); }

 private:
  bool read_face() {
    std::string_view keyword;
    std::string_view rest;
    while (lines_.next(keyword, rest)) {
      if (keyword == "v") ++seen_;
      if (keyword != "f") continue;
      corners_.clear();
      for (auto word = take_word(rest); !word.empty() && word.front() != '#';
           word = take_word(rest)) {
        corners_.push_back(corner(word));
      }
      triangles_ = triangulated(corners_);
      used_ = 0;
      return true;
    }
    return false;
  }

  /// "7", "7/1", "7//2", "7/1/2"; from 1, or back from the last vertex before the face: -1.
  [[nodiscard]] const Vector3d& corner(std::string_view word) const {
    double index = 0.0;
    const bool is_number = parse_number(word.substr(0, word.find('/')), index);
    if (is_number && index < 0.0) index += static_cast<double>(seen_ + 1);
    if (!is_number || !(index >= 1.0) || index > static_cast<double>(vertices_.size()) ||
        index != std::floor(index)) {
      throw InputError(fmt::format("{}: a face names vertex '{}', the file has {}",
                                   lines_.location(),
                                   excerpt(word),
                                   vertices_.size()));
    }
    return vertices_[static_cast<std::size_t>(index) - 1];
  }

  MappedFile file_;
  ObjLines lines_;
  std::vector<Vector3d> vertices_;
  std::size_t seen_ = 0;  // vertices before the face
  std::vector<Vector3d> corners_;
  std::vector<std::array<std::size_t, 3>> triangles_;  // of the face
  std::size_t used_ = 0;                               // of them
};

/// The vertices of a file without faces.
class ObjPoints : public CloudReader {
 public:
  explicit ObjPoints(MappedFile file) : file_(std::move(file)), lines_(file_) {
    ObjLines ahead(file_);
    std::string_view keyword;
    std::string_view rest;
    do {
      if (!ahead.next(keyword, rest)) {
        throw InputError(file_.path() + ": no vertices and no faces; is this an OBJ file?");
      }
    } while (keyword != "v");
    static_cast<void>(ahead.vertex(rest, has_color_));
  }

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    std::string_view keyword;
    std::string_view rest;
    bool ignored = false;
    while (batch.size() < kBatch && lines_.next(keyword, rest)) {
      if (keyword == "v") batch.push_back(lines_.vertex(rest, ignored));
    }
    return !batch.empty();
  }

  [[nodiscard]] bool has_intensity() const override { return false; }
  [[nodiscard]] bool has_color() const override { return has_color_; }
  [[nodiscard]] std::optional<FileUnit> unit() const override { return unit_of(file_); }
  [[nodiscard]] FileColumns columns() const override {
    FileColumns columns;
    columns.notes.emplace_back("it has no faces: its vertices are read as points");
    return columns;
  }
  [[nodiscard]] double share_read() const override { return lines_.share(); }

 private:
  MappedFile file_;
  ObjLines lines_;
  bool has_color_ = false;
};

}  // namespace

ObjLines::ObjLines(const MappedFile& file) : file_(&file), lines_(as_text(file.bytes())) {}

std::string ObjLines::location() const {
  return fmt::format("{}:{}", file_->path(), lines_.number());
}

bool ObjLines::next(std::string_view& keyword, std::string_view& rest) {
  while (lines_.next(rest)) {
    if (!rest.empty() && rest.back() == '\\') {
      joined_.clear();
      bool goes_on = true;
      while (goes_on) {
        goes_on = !rest.empty() && rest.back() == '\\';
        joined_ += rest.substr(0, rest.size() - (goes_on ? 1 : 0));
        joined_ += ' ';
        goes_on = goes_on && lines_.next(rest);
      }
      rest = joined_;
    }
    keyword = take_word(rest);
    if (!keyword.empty() && keyword.front() != '#') return true;
  }
  return false;
}

CloudPoint ObjLines::vertex(std::string_view rest, bool& has_color) const {
  std::array<double, 6> numbers{};
  std::size_t count = 0;
  for (auto word = take_word(rest); !word.empty() && count < numbers.size();
       word = take_word(rest)) {
    if (word.front() == '#') break;
    if (!parse_number(word, numbers[count++])) {
      throw InputError(fmt::format("{}: '{}' is no number", location(), excerpt(word)));
    }
  }
  if (count < 3) throw InputError(location() + ": a vertex wants x y z");
  CloudPoint point{{numbers[0], numbers[1], numbers[2]}};
  has_color = count == numbers.size();
  for (std::size_t c = 0; c < 3 && has_color; ++c) {
    const double part = numbers[3 + c];  // not a number: black
    point.color[c] =
        part > 0.0 ? static_cast<std::uint8_t>(std::lround(255.0 * std::min(part, 1.0))) : 0;
  }
  return point;
}

bool obj_has_faces(const MappedFile& file) {
  // a search alone: faces usually come after all vertices
  const std::string_view text = as_text(file.bytes());
  const auto begins = [&](std::string_view line) {
    return text.starts_with(line.substr(1)) || text.find(line) != std::string_view::npos;
  };
  return begins("\nf ") || begins("\nf\t");
}

std::unique_ptr<MeshTriangles> obj_triangles(MappedFile file, const Progress& progress) {
  return std::make_unique<ObjTriangles>(std::move(file), progress);
}

std::unique_ptr<CloudReader> open_obj_points(MappedFile file) {
  return std::make_unique<ObjPoints>(std::move(file));
}

}  // namespace pointflight
