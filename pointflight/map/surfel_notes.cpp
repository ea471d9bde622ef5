#include "pointflight/map/surfel_notes.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "pointflight/map/map_file.hpp"

namespace pointflight {
namespace {

template <class T>
std::vector<std::byte> bytes_of_values(const std::vector<T>& values) {
  std::vector<std::byte> bytes(values.size() * sizeof(T));
  if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

template <class T>
std::span<const T> values_of_bytes(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)};
}

}  // namespace

std::uint8_t Opacity::of_share(double share) {
  const long byte = std::lround(255.0 * share);
  return static_cast<std::uint8_t>(std::clamp(byte, kWater + 1L, long{kOpaque}));
}

double Opacity::share(std::uint8_t opacity) {
  return opacity <= kWater ? 0.0 : static_cast<double>(opacity) / 255.0;
}

Opacity::Fate Opacity::fate(std::uint8_t opacity, float cos_incidence, double draw) {
  if (opacity == kOpaque) return Fate::kReturns;
  if (opacity > kWater) return draw < share(opacity) ? Fate::kReturns : Fate::kPasses;
  if (cos_incidence >= kMirrorCosine) return Fate::kReturns;
  return opacity == kPane ? Fate::kPasses : Fate::kLost;
}

SurfelNotes::SurfelNotes(
    std::size_t words,
    const std::function<std::span<const std::byte>(std::string_view)>& section,
    const std::function<void(const char*, std::span<const std::byte>)>& corrupt) {
  const auto checked = [&](const char* name, std::size_t size) {
    const auto bytes = section(name);
    if (!bytes.empty() && bytes.size() != size) corrupt(name, bytes);
    return bytes;
  };
  assumed_ = checked(kAssumedSection, (words + 7) / 8);
  labels_ = values_of_bytes<std::uint32_t>(checked(kLabelsSection, words * sizeof(std::uint32_t)));
  opacity_ = values_of_bytes<std::uint8_t>(checked(kOpacitySection, words));
  const auto names = values_of_bytes<char>(section(kClassesSection));
  std::string name;
  for (const char c : names) {
    if (c == '\n') {
      class_names_.push_back(std::move(name));
      name.clear();
    } else {
      name += c;
    }
  }
  if (!name.empty() || class_names_.size() > 256)
    corrupt(kClassesSection, section(kClassesSection));
}

void set_notes(MapDescription& description, std::span<const SurfelNote> of_words) {
  std::vector<std::byte> assumed((of_words.size() + 7) / 8);
  std::vector<std::uint32_t> labels(of_words.size());
  std::vector<std::uint8_t> opacity(of_words.size(), Opacity::kOpaque);
  bool has_assumed = false;
  bool has_labels = false;
  bool has_opacity = false;
  for (std::size_t word = 0; word < of_words.size(); ++word) {
    const SurfelNote& note = of_words[word];
    if (note.is_assumed) assumed[word / 8] |= std::byte{1} << (word % 8);
    labels[word] = (std::uint32_t{note.label.kind} << 24) | note.label.thing;
    opacity[word] = note.opacity;
    has_assumed = has_assumed || note.is_assumed;
    has_labels = has_labels || labels[word] != 0;
    has_opacity = has_opacity || note.opacity != Opacity::kOpaque;
  }
  if (!has_assumed) assumed.clear();
  if (!has_labels) labels.clear();
  if (!has_opacity) opacity.clear();
  set_section(description, kAssumedSection, std::move(assumed));
  set_section(description, kLabelsSection, bytes_of_values(labels));
  set_section(description, kOpacitySection, bytes_of_values(opacity));
}

void set_class_names(MapDescription& description, std::span<const std::string> names) {
  std::string text;
  for (std::size_t kind = 1; kind < names.size(); ++kind) text += names[kind] + "\n";
  const auto bytes = std::as_bytes(std::span(text));
  set_section(description, kClassesSection, {bytes.begin(), bytes.end()});
}

}  // namespace pointflight
