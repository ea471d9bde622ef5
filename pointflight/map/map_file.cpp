#include "pointflight/map/map_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "pointflight/core/argument.hpp"
#include "pointflight/core/hash.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/io/byte_cursor.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kChecksumAt = kMapHeaderSize - 8;

/// Of any coordinate, m.
constexpr double kFarthest = 1e9;

std::size_t aligned(std::size_t offset) {
  return (offset + kMapAlignment - 1) / kMapAlignment * kMapAlignment;
}

struct Layout {
  std::vector<std::byte> header;
  std::vector<std::span<const std::byte>> sections;
  std::vector<std::size_t> offsets;
  std::size_t size = 0;
};

/// What the sections of version 1 are, whatever their number.
bool is_known(std::string_view name) {
  return std::find(std::begin(kMapSectionNames), std::end(kMapSectionNames), name) !=
         std::end(kMapSectionNames);
}

MapSection section_named(std::string_view name) {
  MapSection section{};
  require_argument(!name.empty() && name.size() <= sizeof section.name,
                   "write_map: a section's name has 1 to 16 bytes");
  std::memcpy(section.name, name.data(), name.size());
  return section;
}

/// False if a parameter is none that maps have.
bool is_sane(const MapProperties& p) {
  const auto within = [](double value, double min, double max) {
    return value >= min && value <= max;
  };
  const auto is_position = [](const Vector3d& v) { return (v.array().abs() <= kFarthest).all(); };
  const Aabb& box = p.bounds_world;
  const bool is_box =
      is_position(box.min) && is_position(box.max) && (box.max - box.min).minCoeff() >= 0.0;
  const bool is_finite = is_position(p.origin_world) && (is_box || p.surfel_count == 0) &&
                         std::isfinite(p.intensity_offset) && std::isfinite(p.intensity_step);
  return is_finite && within(p.resolution, kMinResolution, kMaxResolution) &&
         within(static_cast<double>(p.model.support), 1.0, 10.0) &&
         within(static_cast<double>(p.model.tau), 0.01, 1.0) &&
         within(static_cast<double>(p.model.window), 0.01, 10.0);
}

MapHeader header_of(const MapProperties& p) {
  MapHeader header{};
  std::memcpy(header.magic, kMapMagic, sizeof kMapMagic);
  header.version = kMapVersion;
  header.resolution = p.resolution;
  for (int axis = 0; axis < 3; ++axis) {
    header.origin[axis] = p.origin_world[axis];
    header.bounds_min[axis] = p.bounds_world.min[axis];
    header.bounds_max[axis] = p.bounds_world.max[axis];
  }
  header.support = p.model.support;
  header.tau = p.model.tau;
  header.window = p.model.window;
  header.intensity_offset = p.intensity_offset;
  header.intensity_step = p.intensity_step;
  header.surfel_count = p.surfel_count;
  return header;
}

MapProperties properties_of(const MapHeader& header) {
  MapProperties p;
  p.resolution = header.resolution;
  for (int axis = 0; axis < 3; ++axis) {
    p.origin_world[axis] = header.origin[axis];
    p.bounds_world.min[axis] = header.bounds_min[axis];
    p.bounds_world.max[axis] = header.bounds_max[axis];
  }
  p.model = {header.support, header.tau, header.window};
  p.intensity_offset = header.intensity_offset;
  p.intensity_step = header.intensity_step;
  p.surfel_count = header.surfel_count;
  if (p.surfel_count == 0) p.bounds_world = Aabb{};  // whatever stands there
  return p;
}

/// A map that could not be opened again is not written.
void check(const Bvh8& tree, const MapDescription& d) {
  require_argument(is_sane(d), "write_map: a property of the map is out of range");
  require_argument(tree.words.size() >= kLeafPadding &&
                       (tree.intensity.size() == 0 || tree.intensity.size() == tree.words.size()),
                   "write_map: the tree is not one that build_bvh8 made");
}

Layout lay_out(const Bvh8& tree, const MapDescription& d) {
  check(tree, d);
  Layout layout;
  std::vector<MapSection> table;
  const auto add = [&](std::string_view name, std::span<const std::byte> bytes) {
    table.push_back(section_named(name));
    layout.sections.push_back(bytes);
  };
  add("nodes", std::as_bytes(tree.nodes.span()));
  add("words", std::as_bytes(tree.words.span()));
  add("intensity", std::as_bytes(tree.intensity.span()));
  add("metadata", std::as_bytes(std::span<const char>(d.metadata.data(), d.metadata.size())));
  for (const ExtraSection& extra : d.extra) {
    const auto same = [&](const ExtraSection& e) { return e.name == extra.name; };
    require_argument(
        !is_known(extra.name) && std::count_if(d.extra.begin(), d.extra.end(), same) == 1,
        "write_map: an extra section with the name of another");
    add(extra.name, extra.bytes);
  }
  require_argument(table.size() <= kMapSectionsMax, "write_map: too many sections");
  MapHeader header = header_of(d);
  header.section_count = static_cast<std::uint32_t>(table.size());
  std::size_t offset = kMapHeaderSize;
  for (std::size_t i = 0; i < table.size(); ++i) {
    layout.offsets.push_back(offset);
    table[i].offset = offset;
    table[i].size = layout.sections[i].size();
    table[i].checksum = hash64(layout.sections[i]);
    offset = aligned(offset + layout.sections[i].size());
  }
  layout.size = offset;
  layout.header.resize(kMapHeaderSize);
  std::memcpy(layout.header.data(), &header, sizeof header);
  std::memcpy(
      layout.header.data() + sizeof header, table.data(), table.size() * sizeof(MapSection));
  const std::uint64_t checksum = hash64(std::span(layout.header).first(kChecksumAt));
  std::memcpy(layout.header.data() + kChecksumAt, &checksum, sizeof checksum);
  return layout;
}

/// The table of sections of a file whose header is whole. Empty if it has more than fit.
std::vector<MapSection> table_of(std::span<const std::byte> bytes, const MapHeader& header) {
  std::vector<MapSection> table;
  const std::byte* at = bytes.data() + sizeof header;
  if (header.version == 1) {
    for (const char* name : kMapSectionNames) {
      MapSectionV1 old{};
      std::memcpy(&old, at, sizeof old);
      at += sizeof old;
      MapSection& section = table.emplace_back(section_named(name));
      section.offset = old.offset;
      section.size = old.size;
      section.checksum = old.checksum;
    }
    return table;
  }
  if (header.section_count == 0 || header.section_count > kMapSectionsMax) return {};
  table.resize(header.section_count);
  std::memcpy(table.data(), at, table.size() * sizeof(MapSection));
  return table;
}

template <class T>
std::span<const T> view_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)};
}

/// A map whose bytes are a mapped file.
class MappedSurfelMap : public SurfelMap {
 public:
  explicit MappedSurfelMap(const std::string& path) : file_(path) { attach(file_.bytes(), path); }

 private:
  MappedFile file_;
};

/// A map whose bytes are its own copy in memory.
class OwnedSurfelMap : public SurfelMap {
 public:
  OwnedSurfelMap(std::span<const std::byte> bytes, const std::string& name)
      : storage_((bytes.size() + sizeof(Line) - 1) / sizeof(Line)) {
    if (!bytes.empty()) std::memcpy(storage_.data(), bytes.data(), bytes.size());
    attach(std::as_bytes(std::span(storage_)).first(bytes.size()), name);
  }

 private:
  struct alignas(kMapAlignment) Line {
    std::byte bytes[kMapAlignment];
  };
  std::vector<Line> storage_;
};

/// `fail(byte, what)` if sections are named twice, or lie elsewhere than in the file.
template <class Fail>
void check_sections(std::span<const MapSection> sections,
                    std::span<const std::byte> bytes,
                    const Fail& fail) {
  for (std::size_t i = 0; i < sections.size(); ++i) {
    const MapSection& s = sections[i];
    const std::string_view section = section_name(s);
    const std::size_t element = section == "nodes"   ? sizeof(Bvh8Node)
                                : section == "words" ? sizeof(SurfelWord)
                                                     : 1;
    for (std::size_t k = 0; k < i; ++k) {
      if (section_name(sections[k]) == section) {
        fail(sizeof(MapHeader), fmt::format("two sections are called '{}'", excerpt(section)));
      }
    }
    const bool inside = s.offset <= bytes.size() && s.size <= bytes.size() - s.offset;
    if (!inside || s.offset % kMapAlignment != 0 || s.size % element != 0) {
      fail(bytes.size(),
           fmt::format("the section '{}' ({} bytes at {}) does not lie inside the file; it is cut "
                       "off or corrupt",
                       excerpt(section),
                       s.size,
                       s.offset));
    }
  }
}

}  // namespace

void set_section(MapDescription& description, const char* name, std::vector<std::byte> bytes) {
  std::erase_if(description.extra, [&](const ExtraSection& extra) { return extra.name == name; });
  if (!bytes.empty()) description.extra.push_back({name, std::move(bytes)});
}

void set_reflectivity(MapDescription& description, double per_intensity) {
  std::vector<std::byte> bytes(per_intensity > 0.0 ? sizeof per_intensity : 0);
  if (!bytes.empty()) std::memcpy(bytes.data(), &per_intensity, sizeof per_intensity);
  set_section(description, kReflectivitySection, std::move(bytes));
}

void set_levels(MapDescription& description, const IntensityLevels& levels) {
  description.intensity_offset = levels.of_code[0];
  // what a reader makes of it that does not know the section
  description.intensity_step =
      levels.is_linear ? levels.step : levels.of_code[1] - levels.of_code[0];
  std::vector<std::byte> bytes;
  if (!levels.is_linear) {
    const auto data = std::as_bytes(std::span(levels.of_code));
    bytes.assign(data.begin(), data.end());
  }
  set_section(description, kLevelsSection, std::move(bytes));
}

void write_map(OutputFile file, const Bvh8& tree, const MapDescription& description) {
  const Layout layout = lay_out(tree, description);
  file.write(layout.header);
  std::size_t written = kMapHeaderSize;
  const std::vector<std::byte> zeros(kMapAlignment);
  for (std::size_t i = 0; i < layout.sections.size(); ++i) {
    file.write(layout.sections[i]);
    written += layout.sections[i].size();
    file.write(std::span(zeros).first(aligned(written) - written));
    written = aligned(written);
  }
  file.commit();
}

std::vector<std::byte> map_bytes(const Bvh8& tree, const MapDescription& description) {
  const Layout layout = lay_out(tree, description);
  std::vector<std::byte> bytes(layout.size);
  std::memcpy(bytes.data(), layout.header.data(), layout.header.size());
  for (std::size_t i = 0; i < layout.sections.size(); ++i) {
    if (layout.sections[i].empty()) continue;
    std::memcpy(
        bytes.data() + layout.offsets[i], layout.sections[i].data(), layout.sections[i].size());
  }
  return bytes;
}

std::shared_ptr<const SurfelMap> SurfelMap::open(const std::string& path) {
  return std::make_shared<MappedSurfelMap>(path);
}

std::shared_ptr<const SurfelMap> SurfelMap::from_bytes(std::span<const std::byte> bytes,
                                                       const std::string& name) {
  return std::make_shared<OwnedSurfelMap>(bytes, name);
}

void SurfelMap::attach(std::span<const std::byte> bytes, const std::string& name) {
  const auto fail = [&](std::size_t byte, const std::string& what) {
    throw InputError(fmt::format("{}: byte {}: {}; import the cloud again", name, byte, what));
  };
  MapHeader header{};
  if (bytes.size() >= sizeof kMapMagic &&
      std::memcmp(bytes.data(), kMapMagic, sizeof kMapMagic) != 0) {
    throw InputError(
        fmt::format("{}: not a .pfmap file; make one with: pointflight map import {} -o map.pfmap",
                    name,
                    name));
  }
  if (bytes.size() < kMapHeaderSize) fail(bytes.size(), "the map is cut off within its header");
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.version < kMapOldestVersion || header.version > kMapVersion) {
    fail(8,
         fmt::format("map version {}, this program reads {} to {}",
                     header.version,
                     kMapOldestVersion,
                     kMapVersion));
  }
  std::uint64_t checksum = 0;
  std::memcpy(&checksum, bytes.data() + kChecksumAt, sizeof checksum);
  if (checksum != hash64(bytes.first(kChecksumAt))) fail(kChecksumAt, "the header is corrupt");
  sections_ = table_of(bytes, header);
  if (sections_.empty() || (header.version == 1 && header.section_count != sections_.size())) {
    fail(12, "wrong number of sections");
  }
  check_sections(sections_, bytes, fail);
  properties_ = properties_of(header);
  if (!is_sane(properties_)) fail(16, "a parameter in the header is out of range");
  bytes_ = bytes;
  nodes_ = view_of<Bvh8Node>(section("nodes"));
  words_ = view_of<SurfelWord>(section("words"));
  intensity_ = view_of<std::uint8_t>(section("intensity"));
  const auto text = view_of<char>(section("metadata"));
  metadata_ = {text.data(), text.size()};
  if (words_.size() < kLeafPadding || (!intensity_.empty() && intensity_.size() != words_.size())) {
    fail(kMapHeaderSize, "section lengths do not fit each other");
  }
  const auto corrupt = [&](const char* name, std::span<const std::byte> found) {
    fail(static_cast<std::size_t>(found.data() - bytes.data()),
         fmt::format("the section '{}' is corrupt", name));
  };
  if (const auto known = section(KnownSpace::kSection); !known.empty()) {
    known_ = KnownSpace::from_section(known);
    if (!known_) corrupt(KnownSpace::kSection, known);
  }
  notes_ = SurfelNotes(
      words_.size(), [this](std::string_view name) { return section(name); }, corrupt);
  levels_ = IntensityLevels::linear(properties_.intensity_offset, properties_.intensity_step);
  if (const auto levels = section(kLevelsSection); !levels.empty()) {
    if (levels.size() != sizeof levels_.of_code) corrupt(kLevelsSection, levels);
    std::memcpy(levels_.of_code.data(), levels.data(), sizeof levels_.of_code);
    levels_.is_linear = false;
    const bool is_finite = std::all_of(
        levels_.of_code.begin(), levels_.of_code.end(), [](float v) { return std::isfinite(v); });
    if (!is_finite || !std::is_sorted(levels_.of_code.begin(), levels_.of_code.end())) {
      corrupt(kLevelsSection, levels);
    }
  }
  if (const auto scale = section(kReflectivitySection); !scale.empty()) {
    if (scale.size() == sizeof reflectivity_) {
      std::memcpy(&reflectivity_, scale.data(), sizeof reflectivity_);
    }
    if (!(reflectivity_ > 0.0) || !std::isfinite(reflectivity_)) {
      corrupt(kReflectivitySection, scale);
    }
  }
  name_ = name;
  file_size_ = bytes.size();
  scale_ = SurfelScale(static_cast<float>(properties_.resolution));
}

std::span<const std::byte> SurfelMap::section(std::string_view name) const {
  for (const MapSection& s : sections_) {
    if (section_name(s) == name) return bytes_.subspan(s.offset, s.size);
  }
  return {};
}

std::string SurfelMap::hash() const {
  // of the header as version 1 would have it, so that a map has one hash whatever its version
  struct {
    MapHeader header;
    MapSectionV1 sections[std::size(kMapSectionNames)];
  } known{};
  std::memcpy(&known.header, bytes_.data(), sizeof known.header);
  known.header.version = 1;
  known.header.section_count = std::size(kMapSectionNames);
  std::size_t offset = kMapHeaderSize;
  std::uint64_t others = 0;
  for (std::size_t i = 0; i < std::size(kMapSectionNames); ++i) {
    MapSectionV1& as_v1 = known.sections[i];
    const std::string_view name = kMapSectionNames[i];
    if (name == "metadata") continue;  // names of files and options
    as_v1 = {offset, 0, hash64(std::span<const std::byte>{})};
    for (const MapSection& s : sections_) {
      if (section_name(s) == name) as_v1 = {offset, s.size, s.checksum};
    }
    offset = aligned(offset + as_v1.size);
  }
  for (const MapSection& s : sections_) {
    if (is_known(section_name(s))) continue;
    others += hash64(std::as_bytes(std::span(s.name))) ^ s.checksum;
  }
  const std::uint64_t hash = hash64(std::as_bytes(std::span(&known, 1)));
  return fmt::format("{:016x}", others == 0 ? hash : hash ^ others);
}

}  // namespace pointflight
