#include "pointflight/io/internal/e57_scans.hpp"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/byte_cursor.hpp"

namespace pointflight {
namespace {

using tinyxml2::XMLElement;

/// The elements of one file, with its path for messages.
class E57Metadata {
 public:
  explicit E57Metadata(const E57Pages& pages) : path_(pages.path()) {
    const std::string text = pages.xml();
    if (document_.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
      fail(fmt::format("line {} is no XML: {}", document_.ErrorLineNum(), document_.ErrorName()));
    }
  }

  [[nodiscard]] std::vector<E57Scan> scans() const {
    const XMLElement* root = document_.RootElement();
    const XMLElement* list = root == nullptr ? nullptr : root->FirstChildElement("data3D");
    std::vector<E57Scan> scans;
    for (const XMLElement* child = list == nullptr ? nullptr : list->FirstChildElement();
         child != nullptr;
         child = child->NextSiblingElement()) {
      scans.push_back(scan(*child));
    }
    if (scans.empty()) fail("lists no scan (data3D)");
    return scans;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}: its XML {}", path_, what));
  }

  /// Text of a child; empty if it has none.
  static std::string_view text_of(const XMLElement& parent, const char* name) {
    const XMLElement* child = parent.FirstChildElement(name);
    const char* text = child == nullptr ? nullptr : child->GetText();
    return text == nullptr ? std::string_view() : text;
  }

  [[nodiscard]] double number(std::string_view text, double otherwise, const char* name) const {
    if (text.empty()) return otherwise;
    double value = 0.0;
    if (!parse_number(take_word(text), value) || !std::isfinite(value)) {
      fail(fmt::format("has a {} that is no number", name));
    }
    return value;
  }
  [[nodiscard]] double attribute(const XMLElement& element, const char* name, double none) const {
    const char* text = element.Attribute(name);
    return number(text == nullptr ? "" : text, none, name);
  }

  template <class Integer>
  Integer whole(const XMLElement& element, const char* name, Integer otherwise) const {
    const char* text = element.Attribute(name);
    if (text == nullptr) return otherwise;
    const std::string_view digits = text;
    Integer value{};
    const auto [end, error] = std::from_chars(digits.begin(), digits.end(), value);
    if (error != std::errc() || end != digits.end()) {
      fail(fmt::format("line {}: {} is no whole number", element.GetLineNum(), name));
    }
    return value;
  }

  [[nodiscard]] E57Scan scan(const XMLElement& element) const {
    E57Scan scan;
    scan.name = text_of(element, "name");
    if (const XMLElement* pose = element.FirstChildElement("pose"); pose != nullptr) {
      scan.T_world_scan = pose_of(*pose);
    }
    const XMLElement* points = element.FirstChildElement("points");
    const XMLElement* prototype =
        points == nullptr ? nullptr : points->FirstChildElement("prototype");
    if (prototype == nullptr) {
      fail(fmt::format("line {}: a scan has no points with a prototype", element.GetLineNum()));
    }
    scan.section = whole<std::uint64_t>(*points, "fileOffset", 0);
    scan.points = whole<std::uint64_t>(*points, "recordCount", 0);
    for (const XMLElement* child = prototype->FirstChildElement(); child != nullptr;
         child = child->NextSiblingElement()) {
      scan.fields.push_back(field(*child));
    }
    scale_colors(element, scan);
    return scan;
  }

  [[nodiscard]] Pose pose_of(const XMLElement& element) const {
    Pose pose;
    if (const XMLElement* turn = element.FirstChildElement("rotation"); turn != nullptr) {
      const auto part = [&](const char* name) { return number(text_of(*turn, name), 0.0, name); };
      const double w = part("w");
      const double x = part("x");
      const double y = part("y");
      const double z = part("z");
      // all zeros are what some programs write for "not turned"
      const Quaterniond q(w, x, y, z);
      if (q.norm() > 0.0) pose.rotation = q.normalized();
    }
    if (const XMLElement* shift = element.FirstChildElement("translation"); shift != nullptr) {
      const char* names[] = {"x", "y", "z"};
      for (int axis = 0; axis < 3; ++axis) {
        pose.translation[axis] = number(text_of(*shift, names[axis]), 0.0, names[axis]);
      }
    }
    return pose;
  }

  [[nodiscard]] E57Field field(const XMLElement& element) const {
    E57Field field;
    field.name = element.Name();
    const char* stated = element.Attribute("type");
    const std::string_view type = stated == nullptr ? "" : stated;
    if (type == "Float") {
      const char* precision = element.Attribute("precision");
      const bool single = precision != nullptr && std::string_view(precision) == "single";
      field.kind = single ? E57Field::Kind::kSingle : E57Field::Kind::kDouble;
      field.bits = single ? 32 : 64;
      return field;
    }
    if (type != "Integer" && type != "ScaledInteger") {
      fail(
          fmt::format("line {}: the points' field {} has the type '{}'; Integer, ScaledInteger "
                      "and Float are read",
                      element.GetLineNum(),
                      excerpt(field.name),
                      excerpt(type)));
    }
    using Limits = std::numeric_limits<std::int64_t>;
    field.kind = E57Field::Kind::kInteger;
    field.minimum = whole(element, "minimum", Limits::min());
    const std::int64_t maximum = whole(element, "maximum", Limits::max());
    if (maximum < field.minimum) {
      fail(fmt::format("line {}: the maximum is below the minimum", element.GetLineNum()));
    }
    field.bits = static_cast<unsigned>(std::bit_width(static_cast<std::uint64_t>(maximum) -
                                                      static_cast<std::uint64_t>(field.minimum)));
    if (type == "ScaledInteger") {
      field.scale = attribute(element, "scale", 1.0);
      field.offset = attribute(element, "offset", 0.0);
    }
    return field;
  }

  /// Colours go from the limits that the scan states, or its field has, to 0 to 255.
  void scale_colors(const XMLElement& element, E57Scan& scan) const {
    double least = 0.0;
    double most = 255.0;
    for (const E57Field& field : scan.fields) {
      if (field.name != "colorRed" || field.bits >= 32) continue;
      least = field.value(0);
      most = field.value((std::uint64_t{1} << field.bits) - 1);
    }
    if (const XMLElement* limits = element.FirstChildElement("colorLimits"); limits != nullptr) {
      least = number(text_of(*limits, "colorRedMinimum"), least, "colorRedMinimum");
      most = number(text_of(*limits, "colorRedMaximum"), most, "colorRedMaximum");
    }
    if (most > least) {
      scan.color_offset = least;
      scan.color_scale = 255.0 / (most - least);
    }
  }

  std::string path_;
  tinyxml2::XMLDocument document_;
};

}  // namespace

double E57Field::value(std::uint64_t stored) const {
  if (kind == Kind::kSingle) return std::bit_cast<float>(static_cast<std::uint32_t>(stored));
  if (kind == Kind::kDouble) return std::bit_cast<double>(stored);
  // unsigned, so that a damaged file does not overflow
  const auto whole = static_cast<std::int64_t>(stored + static_cast<std::uint64_t>(minimum));
  return static_cast<double>(whole) * scale + offset;
}

std::vector<E57Scan> e57_scans(const E57Pages& pages) {
  return E57Metadata(pages).scans();
}

}  // namespace pointflight
