#pragma once

#include <string>
#include <utility>
#include <vector>

using cairo_surface_t = struct _cairo_surface;
using cairo_t = struct _cairo;

namespace pointflight::picture {

/// sRGB, each 0 to 1.
struct Color {
  double r;  ///< Red.
  double g;  ///< Green.
  double b;  ///< Blue.
};

inline constexpr Color kPaper{1.0, 1.0, 1.0};   ///< Background of pages.
inline constexpr Color kInk{0.15, 0.15, 0.18};  ///< Text and axes.
inline constexpr Color kDim{0.55, 0.55, 0.6};   ///< Secondary text, grids.
/// Surfels that are assumed.
inline constexpr Color kAssumedColor{0.78, 0.24, 0.72};
inline constexpr Color kNight{0.07, 0.07, 0.1};  ///< Background if nothing was measured.

/// Viridis-like scale from dark blue through green to yellow for a fraction from 0 to 1: equal
/// steps look equal, also in grey.
Color ramp(double fraction);

/// Which point of a text its position gives.
enum class Align { kLeft, kCenter, kRight };

/// A picture in memory and the few drawing operations that we need. Coordinates are pixels, y
/// downwards.
class Canvas {
 public:
  /// The rectangle that a text covers.
  struct TextBox {
    double left;        ///< Pixels, as all four.
    double top;         ///< Less than `bottom`.
    double right;       ///< More than `left`.
    double bottom;      ///< Below the base line.
    std::string words;  ///< The text.
  };

  /// With `keeps_strokes` it can be saved as SVG too, and has no pixels to `put`.
  Canvas(int width, int height, Color background, bool keeps_strokes = false);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  /// Pixels.
  [[nodiscard]] int width() const { return width_; }
  /// Pixels.
  [[nodiscard]] int height() const { return height_; }
  /// How wide `text` would draw these words, pixels.
  [[nodiscard]] double text_width(const std::string& words, double size) const;
  /// All texts so far; tests require that none overlaps another or is cut off.
  [[nodiscard]] const std::vector<TextBox>& texts() const { return texts_; }

  /// Draws words; `y` is the base line.
  void text(double x,
            double y,
            const std::string& words,
            double size,
            Color c,
            Align align = Align::kLeft);
  /// The same, in a smaller size and then without their middle if they are wider than `room`.
  void text_within(double x, double y, const std::string& words, double size, double room, Color c);
  /// Upwards along a base line at `x`, its middle at `y`.
  void text_upwards(double x, double y, const std::string& words, double size, Color c);
  /// A filled circle.
  void dot(double x, double y, double radius, Color c, double alpha = 1.0);
  /// A circle of a line `width` pixels wide.
  void ring(double x, double y, double radius, double width, Color c);
  /// A filled rectangle.
  void box(double x, double y, double w, double h, Color c);
  /// A rectangle of a line `width` pixels wide.
  void outline(double x, double y, double w, double h, double width, Color c);
  /// A polyline.
  void line(const std::vector<std::pair<double, double>>& points,
            double width,
            Color c,
            double alpha = 1.0);

  /// Until `end_clip`, nothing is drawn outside of the rectangle.
  void begin_clip(double x, double y, double w, double h);
  /// Ends `begin_clip`.
  void end_clip();

  /// Until `end_pixels`, only `put` may draw.
  void begin_pixels();
  /// Ends `begin_pixels`.
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

}  // namespace pointflight::picture
