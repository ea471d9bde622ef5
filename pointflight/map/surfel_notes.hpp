// What a map may say of each surfel beside its shape and its intensity.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pointflight {

struct MapDescription;

/// Name of the section that marks surfels that no survey saw: for word w bit w % 8 of byte w / 8.
inline constexpr char kAssumedSection[] = "assumed";
/// Name of the section that says what surfels are parts of: a u32 for each word, the class in its
/// highest byte, the thing below.
inline constexpr char kLabelsSection[] = "labels";
/// Name of the section with the names of these classes: a line of text for each, from class 1 on.
inline constexpr char kClassesSection[] = "classes";
/// Name of the section that says how much of a beam surfels send back: an `Opacity` for each word.
inline constexpr char kOpacitySection[] = "opacity";

/// What a surfel is a part of.
struct SurfelLabel {
  static constexpr std::uint32_t kThings = 1u << 24;  ///< Numbers that things may have.

  std::uint8_t kind = 0;    ///< Number of its class; 0: not known.
  std::uint32_t thing = 0;  ///< The same of all surfels of one tree, chair, ...; below `kThings`.

  /// Of the same thing, and of the same class.
  bool operator==(const SurfelLabel&) const = default;
};

/// What happens to a beam that reaches a surfel: a byte of the map.
class Opacity {
 public:
  /// A pane: beams within 15 degrees of its normal come back, others go through.
  static constexpr std::uint8_t kPane = 0;
  /// Still water: beams within 15 degrees of its normal come back, others are lost.
  static constexpr std::uint8_t kWater = 1;
  /// All beams come back. Below: so many 255ths of them do, the others go through.
  static constexpr std::uint8_t kOpaque = 255;
  /// Least |cos| of the incidence at which panes and water send a beam back.
  static constexpr float kMirrorCosine = 0.9659f;

  /// What becomes of a beam.
  enum class Fate { kReturns, kPasses, kLost };

  /// The byte of a share of beams that come back, 0 to 1.
  static std::uint8_t of_share(double share);
  /// Share of the beams that come back, 0 to 1; of panes and water 0.
  static double share(std::uint8_t opacity);
  /// `cos_incidence`: |cos| of the angle between the beam and the surfel's normal. `draw`: uniform
  /// in [0, 1), the beam's own.
  static Fate fate(std::uint8_t opacity, float cos_incidence, double draw);
};

/// All of it of one surfel.
struct SurfelNote {
  bool is_assumed = false;                  ///< No survey saw it.
  SurfelLabel label;                        ///< What it is a part of.
  std::uint8_t opacity = Opacity::kOpaque;  ///< `Opacity`

  /// Nothing is said of it.
  [[nodiscard]] bool is_plain() const {
    return !is_assumed && label == SurfelLabel{} && opacity == Opacity::kOpaque;
  }
};

/// The sections of a map that say so, as they lie in its file.
class SurfelNotes {
 public:
  SurfelNotes() = default;

  /// Of a map with so many words; `section` gives the bytes of one by its name, empty without.
  /// `corrupt` is called with the name of one that is damaged and has to throw.
  SurfelNotes(std::size_t words,
              const std::function<std::span<const std::byte>(std::string_view)>& section,
              const std::function<void(const char*, std::span<const std::byte>)>& corrupt);

  [[nodiscard]] bool has_assumed() const { return !assumed_.empty(); }  ///< Of some surfels.
  [[nodiscard]] bool has_labels() const { return !labels_.empty(); }    ///< Of some surfels.
  [[nodiscard]] bool has_opacity() const { return !opacity_.empty(); }  ///< Of some surfels.

  /// Of a word of the map; false of whatever is no index.
  [[nodiscard]] bool is_assumed(std::uint32_t word) const {
    const std::size_t byte = word / 8;
    return byte < assumed_.size() &&
           (assumed_[byte] & (std::byte{1} << (word % 8))) != std::byte{0};
  }
  /// The same; nothing is known of whatever is no index.
  [[nodiscard]] SurfelLabel label(std::uint32_t word) const {
    if (word >= labels_.size()) return {};
    return {static_cast<std::uint8_t>(labels_[word] >> 24),
            labels_[word] & (SurfelLabel::kThings - 1)};
  }
  /// The same; whatever is no index is opaque.
  [[nodiscard]] std::uint8_t opacity(std::uint32_t word) const {
    return word < opacity_.size() ? opacity_[word] : Opacity::kOpaque;
  }
  /// All of a word.
  [[nodiscard]] SurfelNote of(std::uint32_t word) const {
    return {is_assumed(word), label(word), opacity(word)};
  }
  /// Names of the classes by their numbers: that of 0 is empty.
  [[nodiscard]] const std::vector<std::string>& class_names() const { return class_names_; }

 private:
  std::span<const std::byte> assumed_;
  std::span<const std::uint32_t> labels_;
  std::span<const std::uint8_t> opacity_;
  std::vector<std::string> class_names_ = {""};
};

/// Puts the notes of all words into a description: sections of which nothing is said are left out.
/// The names of classes are another matter (`set_class_names`).
void set_notes(MapDescription& description, std::span<const SurfelNote> of_words);

/// Says what the classes of labels are called; the first name is that of 0, empty.
void set_class_names(MapDescription& description, std::span<const std::string> names);

}  // namespace pointflight
