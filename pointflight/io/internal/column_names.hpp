// Which columns of a cloud's file hold what, by their names.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/io/cloud_reader.hpp"

namespace pointflight {

/// What a column may hold.
enum class ColumnRole : std::uint8_t {
  kX,
  kY,
  kZ,
  kIntensity,
  kTime,
  kRing,
  kRed,
  kGreen,
  kBlue,
  kPackedColor,  ///< 0x00RRGGBB.
};
inline constexpr std::size_t kColumnRoles = 10;

/// The columns of a file by what they hold. Names count in any case; where several would do, the
/// usual name wins (intensity before reflectivity), then the first. CloudCompare's `scalar_`
/// before a name means nothing; a single scalar field of an unknown name is taken for intensity.
class NamedColumns {
 public:
  explicit NamedColumns(const std::vector<std::string>& names);

  /// The number of the column, if there is one.
  [[nodiscard]] std::optional<std::size_t> find(ColumnRole role) const {
    return columns_[static_cast<std::size_t>(role)];
  }
  [[nodiscard]] std::size_t at(ColumnRole role) const { return find(role).value(); }
  [[nodiscard]] bool has_position() const {
    return find(ColumnRole::kX) && find(ColumnRole::kY) && find(ColumnRole::kZ);
  }
  [[nodiscard]] bool has_color() const {
    return find(ColumnRole::kRed) && find(ColumnRole::kGreen) && find(ColumnRole::kBlue);
  }
  /// What is read of them, and what is not.
  [[nodiscard]] const FileColumns& about() const { return about_; }

 private:
  std::array<std::optional<std::size_t>, kColumnRoles> columns_;
  FileColumns about_;
};

}  // namespace pointflight
