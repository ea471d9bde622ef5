// What the things in worlds may be.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pointflight/map/surfel_notes.hpp"

namespace pointflight {

/// A row of the table of classes. New ones go to its end: maps and data sets have their numbers.
struct SceneClass {
  std::string_view name;  ///< The tag of its surfaces.
  /// Number of the class that it is in ADE20K's 150 (Zhou et al. 2017, "Scene parsing through
  /// ADE20K dataset"), 0 if it has none.
  std::uint16_t ade20k;
  /// Its things' diffuse reflectivities at 905 nm, from and to: assumed, of the order that spectral
  /// libraries have of such surfaces.
  ///@{
  float dark, bright;
  ///@}
  std::uint32_t color;  ///< In pictures: 0xRRGGBB, sRGB.
  /// Its surfaces cover part of a beam: leaves, nets, wires.
  bool is_thin = false;
};

/// All of them. Their numbers count from 1: 0 is a surface that nothing is known of.
std::span<const SceneClass> scene_classes();

/// Number of a class by its name; 0 if it is none of them.
std::uint8_t class_number(std::string_view name);

/// `Opacity` of a class's surfaces that does not hang on their shape: glass is a pane, water is
/// water, all others are opaque.
std::uint8_t opacity_of_class(std::string_view name);

/// Names by their numbers, empty that of 0: what a map says of its labels.
std::vector<std::string> class_names();

}  // namespace pointflight
