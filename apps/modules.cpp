#include "apps/modules.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <vector>

#include "pointflight/core/input_error.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;

/// Where a module's library may lie: in a build and where it is installed.
std::vector<fs::path> places_for(const std::string& name) {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path root = program.parent_path().parent_path();
  std::vector<fs::path> places;
  for (const char* folder : {"lib/pointflight", POINTFLIGHT_LIBDIR "/pointflight"}) {
    const fs::path path = root / folder / fmt::format("lib{}.so", name);
    if (fs::exists(path, error)) places.push_back(path);
  }
  return places;
}

/// The module that a library's entry function returns.
template <class Module>
const Module* load(const std::string& name, const std::string& what, const std::string& packages) {
  std::string reason = "this build has none";
  for (const fs::path& path : places_for(name)) {
    // stays loaded: what it made lives until the program ends
    void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr) {
      reason = dlerror();  // NOLINT(concurrency-mt-unsafe): called from one thread
      continue;
    }
    using Entry = const Module* (*)();
    const auto entry = reinterpret_cast<Entry>(dlsym(library, (name + "_module").c_str()));
    if (entry != nullptr) return entry();
    reason = fmt::format("{} is of another version", path.string());
  }
  throw InputError(fmt::format("{}: {}; install {} and build again", what, reason, packages));
}

}  // namespace

bool has_module(const std::string& name) {
  return !places_for(name).empty();
}

const Ros1Module& ros1_module() {
  static const Ros1Module* const module =
      load<Ros1Module>("pointflight_ros1", "ROS 1", "libroscpp-dev and librosbag-storage-dev");
  return *module;
}

const Ros2Module& ros2_module() {
  static const Ros2Module* const module =
      load<Ros2Module>("pointflight_ros2", "ROS 2", "cyclonedds-dev");
  return *module;
}

const MpiModule& mpi_module() {
  static const MpiModule* const module =
      load<MpiModule>("pointflight_mpi", "MPI", "libopenmpi-dev");
  return *module;
}

const DdsModule& dds_module() {
  static const DdsModule* const module =
      load<DdsModule>("pointflight_dds", "--share", "cyclonedds-dev");
  return *module;
}

}  // namespace pointflight::apps
