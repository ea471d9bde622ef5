#include "pointflight/map/surfel_notes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "pointflight/map/edit/map_edit.hpp"
#include "tests/map/edited_map.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::map_of;
using testing::opened;

/// A floor, whose surfels are labelled by the metre that they lie in; those beyond x = 2 m let
/// beams through, and those beyond 3 m are assumed.
EditedMap noted_floor(const std::vector<std::string>& names = {"", "floor", "path"}) {
  ShapeScene scene;
  scene.add_box({0, 0, -0.1}, {4, 2, 0});
  EditedMap floor = testing::noted(*map_of(scene, 0.1), [](const Vector3d& p) {
    SurfelNote note;
    note.label = {static_cast<std::uint8_t>(p.y() < 1.0 ? 1 : 2),
                  static_cast<std::uint32_t>(std::max(0.0, p.x()))};
    if (p.x() > 2.0) note.opacity = Opacity::of_share(0.5);
    note.is_assumed = p.x() > 3.0;
    return note;
  });
  set_class_names(floor.description, names);
  return floor;
}

/// All surfels say what `noted_floor` says of positions, moved back by `shift`.
void expect_notes(const SurfelMap& map, const Vector3d& shift) {
  std::size_t count = 0;
  map.for_each_surfel([&](const Vector3d& moved, const Vector3d&, double, std::uint32_t word) {
    const Vector3d p = moved - shift;
    const SurfelNote note = map.notes().of(word);
    // surfels of a cell may lie on either side of a border
    const auto near = [](double x) { return std::abs(x - std::round(x)) < 0.02; };
    if (near(p.x()) || near(p.y())) return;
    ++count;
    EXPECT_EQ(note.label.kind, p.y() < 1.0 ? 1 : 2);
    EXPECT_EQ(note.label.thing, static_cast<std::uint32_t>(std::max(0.0, p.x())));
    EXPECT_EQ(note.opacity, p.x() > 2.0 ? Opacity::of_share(0.5) : Opacity::kOpaque);
    EXPECT_EQ(note.is_assumed, p.x() > 3.0);
  });
  EXPECT_GT(count, 100u);
}

TEST(Opacity, SharesAreBytesAndSayWhatBecomesOfBeams) {
  EXPECT_EQ(Opacity::of_share(1.0), Opacity::kOpaque);
  EXPECT_GT(Opacity::of_share(0.0), Opacity::kWater);  // it is neither a pane nor water
  for (const double share : {0.1, 0.25, 0.5, 0.9}) {
    EXPECT_NEAR(Opacity::share(Opacity::of_share(share)), share, 0.5 / 255.0);
  }
  const std::uint8_t half = Opacity::of_share(0.5);
  EXPECT_EQ(Opacity::fate(half, 0.0f, 0.49), Opacity::Fate::kReturns);
  EXPECT_EQ(Opacity::fate(half, 1.0f, 0.51), Opacity::Fate::kPasses);
  EXPECT_EQ(Opacity::fate(Opacity::kPane, 0.99f, 0.9), Opacity::Fate::kReturns);
  EXPECT_EQ(Opacity::fate(Opacity::kPane, 0.9f, 0.0), Opacity::Fate::kPasses);
  EXPECT_EQ(Opacity::fate(Opacity::kWater, 0.99f, 0.9), Opacity::Fate::kReturns);
  EXPECT_EQ(Opacity::fate(Opacity::kWater, 0.9f, 0.0), Opacity::Fate::kLost);
}

TEST(SurfelNotes, AreInTheFile) {
  const auto map = opened(noted_floor());
  EXPECT_TRUE(map->notes().has_labels());
  EXPECT_TRUE(map->notes().has_opacity());
  EXPECT_TRUE(map->has_assumed());
  EXPECT_EQ(map->notes().class_names(), (std::vector<std::string>{"", "floor", "path"}));
  expect_notes(*map, Vector3d::Zero());
  EXPECT_TRUE(map->notes().of(0xffffffffu).is_plain());  // no index
}

TEST(SurfelNotes, MapsOfWhichNothingIsSaidHaveNoSections) {
  MapDescription description;
  set_notes(description, std::vector<SurfelNote>(100));
  EXPECT_TRUE(description.extra.empty());
}

TEST(SurfelNotes, EditsKeepThem) {
  const auto map = opened(noted_floor());
  const Vector3d shift(10.0, -3.0, 0.25);
  const Pose shifted{Quaterniond::Identity(), shift};
  expect_notes(*opened(transform_map(*map, shifted, {}, Executor(1))), shift);
  const auto is_kept = [](const Vector3d& p) { return p.y() < 1.5; };
  expect_notes(*opened(crop_map(*map, is_kept, {}, Executor(1))), Vector3d::Zero());
}

TEST(SurfelNotes, MergedThingsHaveNumbersOfTheirOwn) {
  const auto map = opened(noted_floor());
  const Vector3d shift(20.0, 0.0, 0.0);
  const std::vector<PlacedMap> both = {{map, Pose{}}, {map, {Quaterniond::Identity(), shift}}};
  const auto merged = opened(merge_maps(both, {}, Executor(1)));
  EXPECT_EQ(merged->notes().class_names(), map->notes().class_names());
  std::set<std::uint32_t> first;
  std::set<std::uint32_t> second;
  merged->for_each_surfel([&](const Vector3d& p, const Vector3d&, double, std::uint32_t word) {
    const SurfelLabel label = merged->notes().label(word);
    EXPECT_GT(label.kind, 0);
    (p.x() < 10.0 ? first : second).insert(label.thing);
  });
  EXPECT_EQ(first.size(), second.size());
  for (const std::uint32_t thing : first) EXPECT_EQ(second.count(thing), 0u);
  // numbers of classes mean something else in each
  const auto other = opened(noted_floor({"", "road", "grass"}));
  const std::vector<PlacedMap> mixed = {{map, Pose{}}, {other, {Quaterniond::Identity(), shift}}};
  EXPECT_FALSE(opened(merge_maps(mixed, {}, Executor(1)))->notes().has_labels());
}

TEST(SurfelNotes, DamagedOnesAreRefused) {
  EditedMap map = noted_floor();
  for (const char* name : {kLabelsSection, kOpacitySection, kAssumedSection}) {
    EditedMap damaged = noted_floor();
    set_section(damaged.description, name, std::vector<std::byte>(17));
    expect_contains(error_of([&] { opened(damaged); }), name);
  }
  const std::string unended = "floor";
  const auto bytes = std::as_bytes(std::span(unended));
  set_section(map.description, kClassesSection, {bytes.begin(), bytes.end()});
  expect_contains(error_of([&] { opened(map); }), kClassesSection);
}

}  // namespace
}  // namespace pointflight
