#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "pointflight/core/input_error.hpp"
#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/map/surfel_map.hpp"

namespace pointflight::testing {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif
#else
inline constexpr bool kSanitized = false;
#endif

/// How often a test repeats what it draws at random: a tenth under sanitizers, which look at the
/// code and not at the numbers.
template <class T>
constexpr T repeats(T count) {
  return kSanitized ? count / 10 : count;
}

/// A folder that goes away with the test.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] std::string operator/(const std::string& name) const {
    return (path_ / name).string();
  }
  [[nodiscard]] std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

/// While it lives no file of this process may grow beyond some bytes, as on a full disk.
class FullDisk {
 public:
  explicit FullDisk(std::size_t bytes);
  ~FullDisk();
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
};

/// All that lies below a folder, by name: what it is and what it holds, links by their targets.
std::map<std::string, std::string> snapshot(const std::string& folder);

void write_file(const std::string& path, std::string_view bytes);
std::string read_file(const std::string& path);

/// A copy of a shipped vehicle's file with one text in place of another; its path.
std::string changed_vehicle(const TemporaryFolder& folder,
                            const std::string& name,
                            const std::string& from,
                            const std::string& to);

/// A map of sampled shapes; `points_per_cell` points a resolution squared of surface.
std::shared_ptr<const SurfelMap> map_of(const ShapeScene& scene,
                                        double resolution,
                                        double points_per_cell = 20.0,
                                        double noise = 0.0);

/// A map of given points, outliers kept.
std::shared_ptr<const SurfelMap> map_of(const std::vector<Vector3d>& points, double resolution);

/// The import of given points in memory.
ImportedMap import_points(const std::vector<CloudPoint>& points, const ImportOptions& options);

/// Path below the shared data, or "" if it is absent (the test is then skipped).
std::string shared_data(const std::string& relative);

/// The text of the InputError that `action` throws; a test failure if it throws none.
template <class Action>
std::string error_of(const Action& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  ADD_FAILURE() << "no InputError was thrown";
  return "";
}

inline void expect_contains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "'" << part << "' is not in: " << text;
}

#define SKIP_WITHOUT(path) \
  if ((path).empty()) GTEST_SKIP() << "the shared data is absent: nothing to check against"

}  // namespace pointflight::testing
