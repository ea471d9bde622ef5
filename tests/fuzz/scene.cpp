// Any text as a scene of shapes: shapes that can be cast at, or an InputError of one line.
#include <cstdint>
#include <string>
#include <string_view>

#include "pointflight/core/input_error.hpp"
#include "pointflight/geometry/internal/shape_tree.hpp"
#include "pointflight/scenes/exact_scene.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const auto scene = pointflight::parse_scene(text, "input.csv");
    const pointflight::ShapeTree tree(scene.geometry.shapes);
    static_cast<void>(tree.intersect({0, 0, 0}, pointflight::Vector3d(1, 2, 3).normalized()));
  } catch (const pointflight::InputError& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) __builtin_trap();
  }
  return 0;
}
