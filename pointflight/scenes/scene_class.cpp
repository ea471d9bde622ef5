#include "pointflight/scenes/scene_class.hpp"

namespace pointflight {
namespace {

constexpr SceneClass kClasses[] = {
    {"wall", 1, 0.45f, 0.85f},        {"floor", 4, 0.2f, 0.5f},
    {"ceiling", 6, 0.7f, 0.9f},       {"ground", 14, 0.2f, 0.4f},
    {"road", 7, 0.1f, 0.2f},          {"sidewalk", 12, 0.25f, 0.4f},
    {"roof", 2, 0.15f, 0.4f},         {"column", 43, 0.3f, 0.7f},
    {"beam", 0, 0.3f, 0.6f},          {"arch", 2, 0.35f, 0.6f},
    {"vault", 6, 0.4f, 0.7f},         {"stairs", 54, 0.25f, 0.5f},
    {"balustrade", 96, 0.4f, 0.7f},   {"railing", 39, 0.3f, 0.6f},
    {"window frame", 9, 0.5f, 0.85f}, {"glass", 9, 0.08f, 0.08f},
    {"door", 15, 0.3f, 0.8f},         {"pipe", 0, 0.3f, 0.6f},
    {"table", 16, 0.3f, 0.7f},        {"desk", 34, 0.3f, 0.7f},
    {"chair", 20, 0.1f, 0.6f},        {"swivel chair", 76, 0.05f, 0.3f},
    {"monitor", 144, 0.05f, 0.1f},    {"shelf", 25, 0.3f, 0.8f},
    {"cabinet", 11, 0.3f, 0.8f},      {"sofa", 24, 0.1f, 0.6f},
    {"bed", 8, 0.4f, 0.9f},           {"ladder", 0, 0.4f, 0.7f},
    {"tree", 5, 0.25f, 0.4f},         {"bush", 18, 0.4f, 0.55f, true},
    {"log", 0, 0.25f, 0.45f},         {"rock", 35, 0.2f, 0.4f},
    {"grass", 10, 0.4f, 0.55f, true}, {"car", 21, 0.05f, 0.8f},
    {"truck", 84, 0.1f, 0.9f},        {"forklift", 0, 0.2f, 0.6f},
    {"person", 13, 0.1f, 0.7f},       {"pallet", 0, 0.4f, 0.6f},
    {"box", 42, 0.35f, 0.6f},         {"rack", 25, 0.2f, 0.5f},
    {"scaffold", 0, 0.3f, 0.6f},      {"pylon", 85, 0.3f, 0.5f},
    {"wire", 0, 0.1f, 0.3f, true},    {"streetlight", 88, 0.3f, 0.6f},
    {"crane", 0, 0.3f, 0.6f},         {"girder", 0, 0.2f, 0.5f},
    {"rebar", 0, 0.15f, 0.3f, true},  {"machine", 0, 0.2f, 0.6f},
    {"container", 0, 0.2f, 0.7f},     {"lamp", 37, 0.5f, 0.9f},
    {"sign", 44, 0.4f, 0.9f},         {"water", 22, 0.02f, 0.02f},
    {"bench", 70, 0.3f, 0.6f},        {"net", 0, 0.2f, 0.5f, true},
    {"cable", 0, 0.05f, 0.3f, true},  {"rail", 0, 0.2f, 0.5f},
    {"leaves", 5, 0.4f, 0.55f, true},
};

}  // namespace

std::span<const SceneClass> scene_classes() {
  return kClasses;
}

std::uint8_t class_number(std::string_view name) {
  for (std::size_t i = 0; i < std::size(kClasses); ++i) {
    if (kClasses[i].name == name) return static_cast<std::uint8_t>(i + 1);
  }
  return 0;
}

std::uint8_t opacity_of_class(std::string_view name) {
  return name == "glass" ? Opacity::kPane : name == "water" ? Opacity::kWater : Opacity::kOpaque;
}

std::vector<std::string> class_names() {
  std::vector<std::string> names = {""};
  for (const SceneClass& kind : kClasses) names.emplace_back(kind.name);
  return names;
}

}  // namespace pointflight
