#pragma once

#include <span>
#include <string>
#include <vector>

namespace pointflight::picture {

/// A ray on an error picture.
struct ErrorMark {
  float azimuth;    ///< In the sensor frame, rad.
  float elevation;  ///< In the sensor frame, rad.
  float truth;      ///< Range, m; negative if there is nothing to hit.
  float rendered;   ///< Range, m; negative if nothing was hit.
};

/// One view of an error picture: what one sensor saw.
struct ErrorPanel {
  std::string title;             ///< Above it.
  std::vector<ErrorMark> marks;  ///< A ray each.
};

/// Errors over azimuth and elevation: correct rays grey, the brighter the more exact; early ones
/// red, late ones blue, missing returns cyan, false returns orange. Throws InputError if it cannot
/// be written.
void draw_errors(std::span<const ErrorPanel> panels,
                 const std::string& title,
                 const std::string& path);

}  // namespace pointflight::picture
