#pragma once

#include <string>
#include <utility>
#include <vector>

using cairo_surface_t = struct _cairo_surface;
using cairo_t = struct _cairo;

namespace pointflight::apps {

struct Color {
  double r, g, b;
};

inline constexpr Color kPaper{1.0, 1.0, 1.0};
inline constexpr Color kInk{0.15, 0.15, 0.18};
inline constexpr Color kDim{0.55, 0.55, 0.6};
inline constexpr Color kNight{0.07, 0.07, 0.1};

/// Viridis-like scale from dark blue over green to yellow: equal steps look equal, in grey too.
Color ramp(double share);

/// A picture in memory with the few strokes that we need; pixels, y downwards.
class Canvas {
 public:
  Canvas(int width, int height, Color background);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  void text(double x, double y, const std::string& words, double size, Color c);
  void dot(double x, double y, double radius, Color c, double alpha = 1.0);
  void ring(double x, double y, double radius, double width, Color c);
  void box(double x, double y, double w, double h, Color c);
  void line(const std::vector<std::pair<double, double>>& points, double width, Color c);

  /// Between these two only `put` may draw.
  void begin_pixels();
  void end_pixels();
  /// Mixes a colour into one pixel: for clouds of marks.
  void put(int x, int y, Color c, double alpha);

  /// Writes a PNG. Throws InputError.
  void save(const std::string& path);

 private:
  void color(Color c, double alpha = 1.0);

  cairo_surface_t* surface_;
  cairo_t* cr_;
};

}  // namespace pointflight::apps
