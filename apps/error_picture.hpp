#pragma once

#include <span>
#include <string>
#include <vector>

namespace pointflight::apps {

/// A ray on an error picture.
struct ErrorMark {
  float azimuth, elevation;  ///< In the sensor frame, rad.
  float truth;               ///< m; negative where there is nothing to meet.
  float rendered;            ///< m; negative where nothing was met.
};

/// One view of an error picture: what one sensor saw.
struct ErrorPanel {
  std::string title;
  std::vector<ErrorMark> marks;
};

/// Where errors sit, over azimuth and elevation: right rays grey, brighter the more exact; early
/// red, late blue, missing cyan, false returns orange. Throws InputError if it cannot be written.
void draw_errors(std::span<const ErrorPanel> panels,
                 const std::string& title,
                 const std::string& path);

}  // namespace pointflight::apps
