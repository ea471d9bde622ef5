#include "pointflight/scenes/surface_notes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/internal/shape_tree.hpp"
#include "pointflight/map/surfel_scale.hpp"
#include "pointflight/scenes/scene_class.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kSurfelsPerPart = 4096;
constexpr std::uint64_t kRaysThrough = 8;
constexpr double kNearEnough = 0.3;   // cells: a surface that no other is nearer than
constexpr double kLeastCosine = 0.3;  // of such a ray to the surfel's normal

/// Asks the shapes about one surfel after the other.
class SurfaceNotes {
 public:
  SurfaceNotes(const ExactScene& scene, const MapDescription& description)
      : scene_(scene),
        shapes_(scene.geometry.shapes),
        r_(description.resolution),
        origin_(description.origin_world) {
    for (const std::string& tag : scene.tags) {
      const std::uint8_t kind = class_number(tag);
      kinds_.push_back(kind);
      is_thin_.push_back(kind != 0 && scene_classes()[kind - 1U].is_thin);
      mirrors_.push_back(opacity_of_class(tag));
    }
  }

  [[nodiscard]] SurfelNote of(const LeafHeader& leaf, SurfelWord word, std::uint64_t number) const {
    const Surfel surfel = decode(word);
    const Vector3d center =
        origin_ + r_ * (Vector3d(leaf.x, leaf.y, leaf.z) + surfel.center_voxels.cast<double>());
    SurfelNote note;
    const auto shape = shape_at(center, surfel);
    if (!shape) return note;
    const std::uint16_t tag = scene_.shape_tag[*shape];
    note.label.kind = kinds_[tag];
    if (*shape < scene_.shape_object.size()) {
      note.label.thing = scene_.shape_object[*shape] % SurfelLabel::kThings;
    }
    note.opacity = mirrors_[tag];
    if (is_thin_[tag]) note.opacity = Opacity::of_share(share_of_hits(center, surfel, number));
    return note;
  }

 private:
  /// Of the surface that is nearest along one of the axes, the normal before the others, or along
  /// the diagonals between them, if none of the axes hits one.
  [[nodiscard]] std::optional<std::uint32_t> shape_at(const Vector3d& center,
                                                      const Surfel& surfel) const {
    const Matrix3d axes = surfel.axes.cast<double>();
    std::optional<std::uint32_t> nearest;
    double least = r_;
    const auto look = [&](const Vector3d& along) {
      for (const double side : {-1.0, 1.0}) {
        const auto hit = shapes_.intersect(center - side * r_ * along, side * along);
        if (!hit || std::abs(hit->range - r_) >= least) continue;
        least = std::abs(hit->range - r_);
        nearest = hit->shape;
      }
    };
    for (int axis = 0; axis < 3 && least >= kNearEnough * r_; ++axis) {
      look(axes.col(axis).normalized());
    }
    for (int i = 0; i < 4 && !nearest; ++i) {
      const Vector3d diagonal(1.0, i % 2 == 0 ? 1.0 : -1.0, i < 2 ? 1.0 : -1.0);
      look((axes * diagonal).normalized());
    }
    return nearest;
  }

  /// Of rays through random points of the surfel's disc, from half a cell before it to a cell
  /// behind: there the next one may be hit.
  [[nodiscard]] double share_of_hits(const Vector3d& center,
                                     const Surfel& surfel,
                                     std::uint64_t number) const {
    const RandomStream random(0, StreamId::kSurfaceNotes, 0);
    const Matrix3d axes = surfel.axes.cast<double>();
    std::uint64_t hits = 0;
    for (std::uint64_t i = 0; i < kRaysThrough; ++i) {
      const std::uint64_t draw = 2 * (number * kRaysThrough + i);
      const auto [far, around] = random.uniform2(draw);
      const auto [tilt, turn] = random.uniform2(draw + 1);
      const auto on_disc = math::sincos(2.0 * kPi * around);
      const double radius = std::sqrt(3.0 * far);
      const Vector3d p =
          center + r_ * radius *
                       (static_cast<double>(surfel.s[1]) * on_disc.cos * axes.col(1) +
                        static_cast<double>(surfel.s[2]) * on_disc.sin * axes.col(2));
      const double cosine = kLeastCosine + (1.0 - kLeastCosine) * tilt;
      const double sine = std::sqrt(1.0 - cosine * cosine);
      const auto heading = math::sincos(2.0 * kPi * turn);
      const Vector3d way =
          (cosine * axes.col(0) + sine * (heading.cos * axes.col(1) + heading.sin * axes.col(2)))
              .normalized();
      const auto hit = shapes_.intersect(p - 0.5 * r_ * way, way);
      if (hit && hit->range < 1.5 * r_) ++hits;
    }
    return static_cast<double>(hits) / static_cast<double>(kRaysThrough);
  }

  const ExactScene& scene_;
  ShapeTree shapes_;
  double r_;
  Vector3d origin_;
  std::vector<std::uint8_t> kinds_;    // of each tag
  std::vector<bool> is_thin_;          // the same
  std::vector<std::uint8_t> mirrors_;  // `Opacity` of tags, if it does not hang on the surfel
};

}  // namespace

void note_surfaces(const ExactScene& scene,
                   const Bvh8& tree,
                   MapDescription& description,
                   const Executor& executor,
                   const Progress& progress) {
  const SurfaceNotes surfaces(scene, description);
  const auto words = tree.words.span();
  struct Placed {
    LeafHeader leaf;
    std::size_t word;
  };
  std::vector<Placed> surfels;
  for_each_surfel(words, [&](const LeafHeader& leaf, std::size_t word) {
    surfels.push_back({leaf, word});
  });
  std::vector<SurfelNote> notes(words.size());
  report(progress, "labelling", 0.0);
  executor.parallel_for(surfels.size(), kSurfelsPerPart, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Placed& placed = surfels[i];
      notes[placed.word] = surfaces.of(placed.leaf, words[placed.word], i);
    }
  });
  set_notes(description, notes);
  set_class_names(description, class_names());
}

}  // namespace pointflight
