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

/// Which end of the words a place is of.
enum class Align { kLeft, kCenter, kRight };

/// A picture in memory with the few strokes that we need; pixels, y downwards.
class Canvas {
 public:
  /// What words cover.
  struct TextBox {
    double left, top, right, bottom;
    std::string words;
  };

  /// With `keeps_strokes` it can be saved as SVG too, and has no pixels to `put`.
  Canvas(int width, int height, Color background, bool keeps_strokes = false);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] double text_width(const std::string& words, double size) const;
  /// All words so far: none may lie over another or be cut off.
  [[nodiscard]] const std::vector<TextBox>& texts() const { return texts_; }

  /// `y` is the base line.
  void text(double x,
            double y,
            const std::string& words,
            double size,
            Color c,
            Align align = Align::kLeft);
  /// In a smaller size, then without their middle, where they are wider than `room`.
  void text_within(double x, double y, const std::string& words, double size, double room, Color c);
  /// Upwards along a base line at `x`, its middle at `y`.
  void text_upwards(double x, double y, const std::string& words, double size, Color c);
  void dot(double x, double y, double radius, Color c, double alpha = 1.0);
  void ring(double x, double y, double radius, double width, Color c);
  void box(double x, double y, double w, double h, Color c);
  void outline(double x, double y, double w, double h, double width, Color c);
  void line(const std::vector<std::pair<double, double>>& points,
            double width,
            Color c,
            double alpha = 1.0);

  /// Strokes and fills between these two stay in the rectangle.
  void begin_clip(double x, double y, double w, double h);
  void end_clip();

  /// Between these two only `put` may draw.
  void begin_pixels();
  void end_pixels();
  /// Mixes a colour into one pixel: for clouds of marks.
  void put(int x, int y, Color c, double alpha);

  /// Writes a PNG. Throws InputError.
  void save(const std::string& path);
  /// As SVG, of a canvas that keeps strokes; letters are outlines.
  [[nodiscard]] std::string svg() const;

 private:
  void color(Color c, double alpha = 1.0);

  int width_, height_;
  cairo_surface_t* surface_;
  cairo_t* cr_;
  std::vector<TextBox> texts_;
};

}  // namespace pointflight::apps
