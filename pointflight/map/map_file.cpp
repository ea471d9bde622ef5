#include "pointflight/map/map_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "pointflight/core/argument.hpp"
#include "pointflight/core/hash.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kChecksumAt = kMapHeaderSize - 8;

std::size_t aligned(std::size_t offset) {
  return (offset + kMapAlignment - 1) / kMapAlignment * kMapAlignment;
}

struct Layout {
  std::vector<std::byte> header;
  std::array<std::span<const std::byte>, kMapSections> sections;
  std::array<std::size_t, kMapSections> offsets{};
  std::size_t size = 0;
};

/// A map that could not be opened again is not written.
void check(const Bvh8& tree, const MapDescription& d) {
  require_argument(d.resolution >= kMinResolution && d.resolution <= kMaxResolution &&
                       d.origin_world.allFinite() && std::isfinite(d.intensity_offset) &&
                       std::isfinite(d.intensity_step),
                   "write_map: the resolution, the origin or the scale of intensities is no number "
                   "that maps have");
  require_argument(d.model.support >= 1.0f && d.model.tau >= 0.01f && d.model.tau <= 1.0f &&
                       d.model.window >= 0.01f,
                   "write_map: the render model is out of range");
  require_argument(tree.words.size() >= kLeafPadding &&
                       (tree.intensity.size() == 0 || tree.intensity.size() == tree.words.size()),
                   "write_map: the tree is not one that build_bvh8 made");
}

Layout lay_out(const Bvh8& tree, const MapDescription& d) {
  check(tree, d);
  Layout layout;
  layout.sections = {std::as_bytes(tree.nodes.span()),
                     std::as_bytes(tree.words.span()),
                     std::as_bytes(tree.intensity.span()),
                     std::as_bytes(std::span<const char>(d.metadata.data(), d.metadata.size()))};
  MapHeader header{};
  std::memcpy(header.magic, kMapMagic, sizeof kMapMagic);
  header.version = kMapVersion;
  header.section_count = kMapSections;
  header.resolution = d.resolution;
  for (int axis = 0; axis < 3; ++axis) {
    header.origin[axis] = d.origin_world[axis];
    header.bounds_min[axis] = d.bounds_world.min[axis];
    header.bounds_max[axis] = d.bounds_world.max[axis];
  }
  header.support = d.model.support;
  header.tau = d.model.tau;
  header.window = d.model.window;
  header.intensity_offset = d.intensity_offset;
  header.intensity_step = d.intensity_step;
  header.surfel_count = d.surfel_count;
  std::size_t offset = kMapHeaderSize;
  for (std::size_t i = 0; i < kMapSections; ++i) {
    layout.offsets[i] = offset;
    header.sections[i] = {offset, layout.sections[i].size(), hash64(layout.sections[i])};
    offset = aligned(offset + layout.sections[i].size());
  }
  layout.size = offset;
  layout.header.resize(kMapHeaderSize);
  std::memcpy(layout.header.data(), &header, sizeof header);
  const std::uint64_t checksum = hash64(std::span(layout.header).first(kChecksumAt));
  std::memcpy(layout.header.data() + kChecksumAt, &checksum, sizeof checksum);
  return layout;
}

template <class T>
std::span<const T> section_view(std::span<const std::byte> bytes, const MapSection& section) {
  return {reinterpret_cast<const T*>(bytes.data() + section.offset),
          static_cast<std::size_t>(section.size / sizeof(T))};
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

}  // namespace

void write_map(OutputFile file, const Bvh8& tree, const MapDescription& description) {
  const Layout layout = lay_out(tree, description);
  file.write(layout.header);
  std::size_t written = kMapHeaderSize;
  const std::vector<std::byte> zeros(kMapAlignment);
  for (std::size_t i = 0; i < kMapSections; ++i) {
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
  for (std::size_t i = 0; i < kMapSections; ++i) {
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
  if (header.version != kMapVersion) {
    fail(8, fmt::format("map version {}, this program reads {}", header.version, kMapVersion));
  }
  std::uint64_t checksum = 0;
  std::memcpy(&checksum, bytes.data() + kChecksumAt, sizeof checksum);
  if (checksum != hash64(bytes.first(kChecksumAt))) fail(kChecksumAt, "the header is corrupt");
  if (header.section_count != kMapSections) fail(12, "wrong number of sections");
  constexpr std::size_t kElement[kMapSections] = {sizeof(Bvh8Node), sizeof(SurfelWord), 1, 1};
  for (std::size_t i = 0; i < kMapSections; ++i) {
    const MapSection& s = header.sections[i];
    const bool inside = s.offset <= bytes.size() && s.size <= bytes.size() - s.offset;
    if (!inside || s.offset % kMapAlignment != 0 || s.size % kElement[i] != 0) {
      fail(bytes.size(),
           fmt::format("the section '{}' ({} bytes at {}) does not lie inside the file; it is cut "
                       "off or corrupt",
                       kMapSectionNames[i],
                       s.size,
                       s.offset));
    }
  }
  bool finite = std::isfinite(header.intensity_offset) && std::isfinite(header.intensity_step);
  for (int axis = 0; axis < 3; ++axis) finite = finite && std::isfinite(header.origin[axis]);
  const auto within = [](double value, double min, double max) {
    return value >= min && value <= max;
  };
  if (!finite || !within(header.resolution, kMinResolution, kMaxResolution) ||
      !within(static_cast<double>(header.support), 1.0, 10.0) ||
      !within(static_cast<double>(header.tau), 0.01, 1.0) ||
      !within(static_cast<double>(header.window), 0.01, 10.0)) {
    fail(16, "a parameter in the header is out of range");
  }
  nodes_ = section_view<Bvh8Node>(bytes, header.sections[kNodes]);
  words_ = section_view<SurfelWord>(bytes, header.sections[kWords]);
  intensity_ = section_view<std::uint8_t>(bytes, header.sections[kIntensity]);
  const auto text = section_view<char>(bytes, header.sections[kMetadata]);
  metadata_ = {text.data(), text.size()};
  if (words_.size() < kLeafPadding || (!intensity_.empty() && intensity_.size() != words_.size())) {
    fail(kMapHeaderSize, "section lengths do not fit each other");
  }
  name_ = name;
  bytes_ = bytes;
  file_size_ = bytes.size();
  resolution_ = header.resolution;
  scale_ = SurfelScale(static_cast<float>(resolution_));
  for (int axis = 0; axis < 3; ++axis) {
    origin_[axis] = header.origin[axis];
    bounds_.min[axis] = header.bounds_min[axis];
    bounds_.max[axis] = header.bounds_max[axis];
  }
  model_ = {header.support, header.tau, header.window};
  surfel_count_ = header.surfel_count;
  intensity_offset_ = header.intensity_offset;
  intensity_step_ = header.intensity_step;
}

std::string SurfelMap::hash() const {
  MapHeader header{};
  std::memcpy(&header, bytes_.data(), sizeof header);
  header.sections[kMetadata] = {};  // names of files and options
  return fmt::format("{:016x}", hash64(std::as_bytes(std::span(&header, 1))));
}

void SurfelMap::verify() const {
  const auto fail = [&](const char* section, const std::string& what) {
    throw InputError(
        fmt::format("{}: section '{}': {}; import the cloud again", name_, section, what));
  };
  MapHeader header{};
  std::memcpy(&header, bytes_.data(), sizeof header);
  for (std::size_t i = 0; i < kMapSections; ++i) {
    const MapSection& s = header.sections[i];
    if (hash64(bytes_.subspan(s.offset, s.size)) != s.checksum) {
      fail(kMapSectionNames[i],
           fmt::format("the checksum of its {} bytes at {} does not match", s.size, s.offset));
    }
  }
  const std::size_t usable_words = words_.size() - kLeafPadding;
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    const Bvh8Node& node = nodes_[n];
    std::size_t inner = node.first_inner;
    std::size_t word = node.first_leaf_word;
    for (const std::uint8_t meta : node.meta) {
      if (meta == Bvh8Node::kInner) {
        if (inner <= n || inner >= nodes_.size()) {
          fail("nodes", fmt::format("node {} points to node {}", n, inner));
        }
        ++inner;
      } else if (meta > 8) {
        fail("nodes", fmt::format("node {} has a child of kind {}", n, meta));
      } else if (meta > 0) {
        if (word + meta >= usable_words || decode_leaf(words_[word]).count != meta) {
          fail("words", fmt::format("node {} points to a leaf at word {}", n, word));
        }
        word += meta + 1u;
      }
    }
    if (!std::isfinite(node.scale) || !(node.scale > 0.0f)) {
      fail("nodes", fmt::format("node {} has no size", n));
    }
  }
}

}  // namespace pointflight
