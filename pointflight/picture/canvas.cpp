#include "pointflight/picture/canvas.hpp"

#include <cairo-svg.h>
#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <exception>
#include <new>
#include <span>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/output_file.hpp"

namespace pointflight::picture {
namespace {

// of letters in units of the font's size
constexpr double kAscent = 0.75;
constexpr double kDescent = 0.22;

/// Where cairo writes to; an exception must not pass through its C code.
struct PngTarget {
  OutputFile file;
  std::exception_ptr error;
};

cairo_status_t append(void* target, const unsigned char* data, unsigned length) {
  auto& png = *static_cast<PngTarget*>(target);
  try {
    png.file.write(std::as_bytes(std::span<const unsigned char>(data, length)));
    return CAIRO_STATUS_SUCCESS;
  } catch (...) {
    png.error = std::current_exception();
    return CAIRO_STATUS_WRITE_ERROR;
  }
}

cairo_surface_t* recording_surface(int width, int height) {
  const cairo_rectangle_t all{0.0, 0.0, static_cast<double>(width), static_cast<double>(height)};
  return cairo_recording_surface_create(CAIRO_CONTENT_COLOR, &all);
}

void replay(cairo_surface_t* from, cairo_surface_t* to) {
  cairo_t* cr = cairo_create(to);
  cairo_set_source_surface(cr, from, 0.0, 0.0);
  cairo_paint(cr);
  cairo_destroy(cr);
}

}  // namespace

Color ramp(double share) {
  constexpr Color kStops[] = {{0.267, 0.005, 0.329},
                              {0.231, 0.318, 0.545},
                              {0.129, 0.569, 0.549},
                              {0.369, 0.788, 0.384},
                              {0.993, 0.906, 0.144}};
  const double at = std::clamp(share, 0.0, 1.0) * 4.0;
  const int i = std::min(3, static_cast<int>(at));
  const double f = at - i;
  const Color& a = kStops[i];
  const Color& b = kStops[i + 1];
  return {a.r + f * (b.r - a.r), a.g + f * (b.g - a.g), a.b + f * (b.b - a.b)};
}

Canvas::Canvas(int width, int height, Color background, bool keeps_strokes)
    : width_(width),
      height_(height),
      surface_(keeps_strokes ? recording_surface(width, height)
                             : cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height)),
      cr_(cairo_create(surface_)) {
  // cairo goes on with surfaces that have no pixels where it gets no memory
  if (cairo_status(cr_) != CAIRO_STATUS_SUCCESS) {
    cairo_destroy(cr_);
    cairo_surface_destroy(surface_);
    throw std::bad_alloc();
  }
  color(background);
  cairo_paint(cr_);
  cairo_select_font_face(cr_, "sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
}
Canvas::~Canvas() {
  cairo_destroy(cr_);
  cairo_surface_destroy(surface_);
}

void Canvas::color(Color c, double alpha) {
  cairo_set_source_rgba(cr_, c.r, c.g, c.b, alpha);
}

double Canvas::text_width(const std::string& words, double size) const {
  cairo_text_extents_t extents;
  cairo_set_font_size(cr_, size);
  cairo_text_extents(cr_, words.c_str(), &extents);
  return extents.x_advance;
}

void Canvas::text(double x, double y, const std::string& words, double size, Color c, Align align) {
  const double width = text_width(words, size);
  if (align != Align::kLeft) x -= align == Align::kCenter ? 0.5 * width : width;
  color(c);
  cairo_set_font_size(cr_, size);
  cairo_move_to(cr_, x, y);
  cairo_show_text(cr_, words.c_str());
  texts_.push_back({x, y - kAscent * size, x + width, y + kDescent * size, words});
}

void Canvas::text_within(
    double x, double y, const std::string& words, double size, double room, Color c) {
  constexpr double kSmallest = 10.0;
  while (size > kSmallest && text_width(words, size) > room) size -= 0.5;
  std::string shown = words;
  for (std::size_t cut = 1; text_width(shown, size) > room && 2 * cut + 2 < words.size(); ++cut) {
    const std::size_t half = (words.size() - cut) / 2;
    shown = words.substr(0, half) + "..." + words.substr(half + cut);
  }
  text(x, y, shown, size, c);
}

void Canvas::text_upwards(double x, double y, const std::string& words, double size, Color c) {
  const double width = text_width(words, size);
  color(c);
  cairo_save(cr_);
  cairo_set_font_size(cr_, size);
  cairo_move_to(cr_, x, y + 0.5 * width);
  cairo_rotate(cr_, -0.5 * kPi);
  cairo_show_text(cr_, words.c_str());
  cairo_restore(cr_);
  texts_.push_back(
      {x - kAscent * size, y - 0.5 * width, x + kDescent * size, y + 0.5 * width, words});
}

void Canvas::dot(double x, double y, double radius, Color c, double alpha) {
  color(c, alpha);
  cairo_new_path(cr_);
  cairo_arc(cr_, x, y, radius, 0.0, 2.0 * kPi);
  cairo_fill(cr_);
}

void Canvas::ring(double x, double y, double radius, double width, Color c) {
  color(c);
  cairo_set_line_width(cr_, width);
  cairo_new_path(cr_);
  cairo_arc(cr_, x, y, radius, 0.0, 2.0 * kPi);
  cairo_stroke(cr_);
}

void Canvas::box(double x, double y, double w, double h, Color c) {
  color(c);
  cairo_new_path(cr_);
  cairo_rectangle(cr_, x, y, w, h);
  cairo_fill(cr_);
}

void Canvas::outline(double x, double y, double w, double h, double width, Color c) {
  color(c);
  cairo_set_line_width(cr_, width);
  cairo_new_path(cr_);
  cairo_rectangle(cr_, x, y, w, h);
  cairo_stroke(cr_);
}

void Canvas::begin_clip(double x, double y, double w, double h) {
  cairo_save(cr_);
  cairo_new_path(cr_);
  cairo_rectangle(cr_, x, y, w, h);
  cairo_clip(cr_);
}

void Canvas::end_clip() {
  cairo_restore(cr_);
}

void Canvas::line(const std::vector<std::pair<double, double>>& points,
                  double width,
                  Color c,
                  double alpha) {
  color(c, alpha);
  cairo_set_line_width(cr_, width);
  cairo_set_line_join(cr_, CAIRO_LINE_JOIN_ROUND);
  cairo_new_path(cr_);  // text leaves a current point behind
  for (const auto& [x, y] : points) cairo_line_to(cr_, x, y);
  cairo_stroke(cr_);
}

void Canvas::save(const std::string& path) {
  cairo_surface_flush(surface_);
  PngTarget png{OutputFile(path), nullptr};
  cairo_surface_t* image = surface_;
  if (cairo_surface_get_type(surface_) == CAIRO_SURFACE_TYPE_RECORDING) {
    image = cairo_image_surface_create(CAIRO_FORMAT_RGB24, width_, height_);
    replay(surface_, image);
  }
  const auto status = cairo_surface_write_to_png_stream(image, append, &png);
  if (image != surface_) cairo_surface_destroy(image);
  if (png.error) std::rethrow_exception(png.error);
  if (status != CAIRO_STATUS_SUCCESS) {
    throw InputError(fmt::format("{}: cannot draw: {}", path, cairo_status_to_string(status)));
  }
  png.file.commit();
}

std::string Canvas::svg() const {
  std::string text;
  const auto take = [](void* to, const unsigned char* data, unsigned length) {
    static_cast<std::string*>(to)->append(reinterpret_cast<const char*>(data), length);
    return CAIRO_STATUS_SUCCESS;
  };
  cairo_surface_t* surface = cairo_svg_surface_create_for_stream(take, &text, width_, height_);
  replay(surface_, surface);
  cairo_surface_finish(surface);
  cairo_surface_destroy(surface);
  return text;
}

void Canvas::begin_pixels() {
  cairo_surface_flush(surface_);
  if (cairo_image_surface_get_data(surface_) == nullptr) throw std::bad_alloc();
}
void Canvas::end_pixels() {
  cairo_surface_mark_dirty(surface_);
}

void Canvas::put(int x, int y, Color c, double alpha) {
  if (x < 0 || y < 0 || x >= width() || y >= height()) return;
  auto* row = cairo_image_surface_get_data(surface_) +
              static_cast<std::ptrdiff_t>(y) * cairo_image_surface_get_stride(surface_);
  std::uint32_t pixel = 0;
  std::memcpy(&pixel, row + static_cast<std::ptrdiff_t>(x) * 4, 4);
  const auto mix = [&](int shift, double value) {
    const double old = static_cast<double>((pixel >> shift) & 255u);
    const double mixed = old + alpha * (255.0 * value - old);
    return static_cast<std::uint32_t>(std::clamp(mixed, 0.0, 255.0)) << shift;
  };
  pixel = mix(16, c.r) | mix(8, c.g) | mix(0, c.b);
  std::memcpy(row + static_cast<std::ptrdiff_t>(x) * 4, &pixel, 4);
}

}  // namespace pointflight::picture
