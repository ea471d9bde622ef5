#include "pointflight/scenes/scene_class.hpp"

namespace pointflight {
namespace {

constexpr SceneClass kClasses[] = {
    {"wall", 1, 0.45f, 0.85f, 0xd9d2c3},        {"floor", 4, 0.2f, 0.5f, 0x9e9484},
    {"ceiling", 6, 0.7f, 0.9f, 0xecebe6},       {"ground", 14, 0.2f, 0.4f, 0x7d7350},
    {"road", 7, 0.1f, 0.2f, 0x58585c},          {"sidewalk", 12, 0.25f, 0.4f, 0xa8a59e},
    {"roof", 2, 0.15f, 0.4f, 0x9e5240},         {"column", 43, 0.3f, 0.7f, 0xcfc6b4},
    {"beam", 0, 0.3f, 0.6f, 0x84848c},          {"arch", 2, 0.35f, 0.6f, 0xcdb898},
    {"vault", 6, 0.4f, 0.7f, 0xd8ccb0},         {"stairs", 54, 0.25f, 0.5f, 0xa89a84},
    {"balustrade", 96, 0.4f, 0.7f, 0xd2c8b4},   {"railing", 39, 0.3f, 0.6f, 0x5a5f6b},
    {"window frame", 9, 0.5f, 0.85f, 0xf2f2ee}, {"glass", 9, 0.08f, 0.08f, 0x8fc0df},
    {"door", 15, 0.3f, 0.8f, 0x9a663d},         {"pipe", 0, 0.3f, 0.6f, 0x8c99a8},
    {"table", 16, 0.3f, 0.7f, 0xb3804d},        {"desk", 34, 0.3f, 0.7f, 0xc29a6b},
    {"chair", 20, 0.1f, 0.6f, 0x596b9e},        {"swivel chair", 76, 0.05f, 0.3f, 0x33405a},
    {"monitor", 144, 0.05f, 0.1f, 0x1c1c20},    {"shelf", 25, 0.3f, 0.8f, 0x99734d},
    {"cabinet", 11, 0.3f, 0.8f, 0xb3ada3},      {"sofa", 24, 0.1f, 0.6f, 0x8c4040},
    {"bed", 8, 0.4f, 0.9f, 0xccccde},           {"ladder", 0, 0.4f, 0.7f, 0xf0bf26},
    {"tree", 5, 0.25f, 0.4f, 0x6b4d33},         {"bush", 18, 0.4f, 0.55f, 0x4d7f38, true},
    {"log", 0, 0.25f, 0.45f, 0x735438},         {"rock", 35, 0.2f, 0.4f, 0x8c8780},
    {"grass", 10, 0.4f, 0.55f, 0x739e40, true}, {"car", 21, 0.05f, 0.8f, 0x5b7fa6},
    {"truck", 84, 0.1f, 0.9f, 0xd9d9e0},        {"forklift", 0, 0.2f, 0.6f, 0xf2a60d},
    {"person", 13, 0.1f, 0.7f, 0xe65926},       {"pallet", 0, 0.4f, 0.6f, 0xbf9961},
    {"box", 42, 0.35f, 0.6f, 0xb88c59},         {"rack", 25, 0.2f, 0.5f, 0x3359a6},
    {"scaffold", 0, 0.3f, 0.6f, 0xb3b8bc},      {"pylon", 85, 0.3f, 0.5f, 0x949ea8},
    {"wire", 0, 0.1f, 0.3f, 0x303036, true},    {"streetlight", 88, 0.3f, 0.6f, 0x4d5257},
    {"crane", 0, 0.3f, 0.6f, 0xf2bf1a},         {"girder", 0, 0.2f, 0.5f, 0x99402e},
    {"rebar", 0, 0.15f, 0.3f, 0x734733, true},  {"machine", 0, 0.2f, 0.6f, 0x40807a},
    {"container", 0, 0.2f, 0.7f, 0x26668f},     {"lamp", 37, 0.5f, 0.9f, 0xfff2b3},
    {"sign", 44, 0.4f, 0.9f, 0xd92626},         {"water", 22, 0.02f, 0.02f, 0x3a7aa8},
    {"bench", 70, 0.3f, 0.6f, 0x8c6138},        {"net", 0, 0.2f, 0.5f, 0x599966, true},
    {"cable", 0, 0.05f, 0.3f, 0x26262b, true},  {"rail", 0, 0.2f, 0.5f, 0x6b6461},
    {"leaves", 5, 0.4f, 0.55f, 0x4f8c38, true},
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
