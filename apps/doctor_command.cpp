#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/modules.hpp"
#include "apps/settings_json.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/parallel.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/core/version.hpp"
#include "pointflight/gpu/gpu_list.hpp"
#include "pointflight/render/instruction_sets.hpp"
#include "pointflight/view/page_content.hpp"
#include "pointflight_commit.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;

/// How something is.
enum class Finding {
  kOk,
  kNote,     ///< Works; not as well as it could, or without something that most do not need.
  kTrouble,  ///< Commands will fail.
};

/// A line of the report.
struct Check {
  std::string what;
  Finding finding = Finding::kOk;
  std::string said;
  std::string remedy;  ///< Empty if there is nothing to do.
};

std::string environment(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nobody sets it
  return value == nullptr ? "" : value;
}

/// A number in a file of /proc; -1 if there is none.
double proc_number(const std::string& path, const std::string& key = {}) {
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line)) {
    if (!line.starts_with(key)) continue;
    try {
      return std::stod(line.substr(key.size()));
    } catch (const std::exception&) {
      return -1.0;
    }
  }
  return -1.0;
}

Check check_processor() {
  std::string sets;
  for (const std::string& name : instruction_sets()) sets += (sets.empty() ? "" : ", ") + name;
  const int threads = Executor().threads();
  return {
      "processor", Finding::kOk, fmt::format("{} cores for this process; {}", threads, sets), ""};
}

Check check_memory() {
  const double gigabytes = proc_number("/proc/meminfo", "MemAvailable:") / 1048576.0;
  Check check{"memory", Finding::kOk, fmt::format("{:.1f} GB free", gigabytes), ""};
  if (gigabytes >= 0.0 && gigabytes < 2.0) {
    check.finding = Finding::kNote;
    check.remedy = "imports of large clouds take more: map import --resolution with a larger value";
  }
  return check;
}

Check check_data() {
  Check check{"data", Finding::kOk, "", ""};
  try {
    check.said = fmt::format("{}: {} LiDARs, {} vehicles",
                             data_folder(),
                             model_names("lidars").size(),
                             model_names("vehicles").size());
  } catch (const InputError& error) {
    check = {"data", Finding::kTrouble, error.what(), "install again, or set POINTFLIGHT_DATA"};
  }
  return check;
}

Check check_folder() {
  std::error_code failed;
  const fs::path here = fs::current_path(failed);
  const fs::space_info space = fs::space(here, failed);
  Check check{"folder", Finding::kOk, "", ""};
  if (failed || access(here.c_str(), W_OK) != 0) {
    check.finding = Finding::kTrouble;
    check.said = fmt::format("{} cannot be written to", here.string());
    check.remedy = "change to a folder of your own";
    return check;
  }
  const double gigabytes = static_cast<double>(space.available) / 1e9;
  check.said = fmt::format("{}: {:.1f} GB free", here.string(), gigabytes);
  if (gigabytes < 1.0) {
    check.finding = Finding::kNote;
    check.remedy = "scans of a minute take some 100 MB: fly --no-scans, or another disk";
  }
  return check;
}

Check check_gpu() {
  try {
    std::string devices;
    for (const GpuInfo& gpu : list_gpus()) {
      devices += fmt::format("{}{} ({}{})",
                             devices.empty() ? "" : ", ",
                             gpu.name,
                             gpu.driver,
                             gpu.is_processor ? ", computes on the processor" : "");
    }
    return {"GPU", Finding::kOk, devices, ""};
  } catch (const InputError& error) {
    return {"GPU", Finding::kOk, fmt::format("none is used: {}", error.what()), ""};
  }
}

/// What a build has or lacks.
Check check_part(const std::string& what,
                 bool is_there,
                 const std::string& has,
                 const std::string& remedy) {
  return is_there ? Check{what, Finding::kOk, has, ""}
                  : Check{what, Finding::kNote, "not in this build", remedy};
}

Check check_ros1() {
  const std::string master = environment("ROS_MASTER_URI");
  return check_part(
      "ROS 1",
      has_module("pointflight_ros1"),
      master.empty() ? "ROS_MASTER_URI is not set: http://localhost:11311" : "master at " + master,
      "build where libroscpp-dev and librosbag-storage-dev are installed");
}

Check check_ros2() {
  Check check = check_part(
      "ROS 2", has_module("pointflight_ros2"), "", "build where cyclonedds-dev is installed");
  if (check.finding != Finding::kOk) return check;
  const std::string domain = environment("ROS_DOMAIN_ID");
  const std::string distribution = environment("ROS_DISTRO");
  check.said = fmt::format("domain {}{}",
                           domain.empty() ? "0" : domain,
                           distribution.empty() ? "" : ", " + distribution + " is sourced");
  if (environment("RMW_IMPLEMENTATION") == "rmw_zenoh_cpp") {
    check.finding = Finding::kNote;
    check.remedy =
        "RMW_IMPLEMENTATION: nodes on Zenoh do not hear DDS; unset it for those beside pointflight";
  }
  return check;
}

/// Whether other machines can be found by multicast.
Check check_network() {
  std::string able;
  ifaddrs* first = nullptr;
  if (getifaddrs(&first) == 0) {
    for (const ifaddrs* i = first; i != nullptr; i = i->ifa_next) {
      constexpr unsigned kNeeded = IFF_UP | IFF_MULTICAST;
      if (i->ifa_addr == nullptr || i->ifa_addr->sa_family != AF_INET) continue;
      if ((i->ifa_flags & kNeeded) != kNeeded) continue;
      able += (able.empty() ? "" : ", ") + std::string(i->ifa_name);
    }
    freeifaddrs(first);
  }
  if (!able.empty()) return {"network", Finding::kOk, "multicast on " + able, ""};
  return {"network",
          Finding::kNote,
          "no interface with multicast",
          "ROS 2 and shared runs find each other on this machine alone: "
          "ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST"};
}

Check check_buffers() {
  const double bytes = proc_number("/proc/sys/net/core/rmem_max");
  constexpr double kScan = 2e6;  // a scan of 60,000 points
  if (bytes < 0.0) return {"buffers", Finding::kOk, "of sockets: unknown", ""};
  if (bytes >= kScan)
    return {"buffers", Finding::kOk, fmt::format("of sockets: {:.1f} MB", bytes / 1e6), ""};
  return {"buffers",
          Finding::kNote,
          fmt::format("of sockets: {:.1f} MB, less than a large scan", bytes / 1e6),
          "ROS 2 over a network may lose scans: sudo sysctl -w net.core.rmem_max=8388608"};
}

std::vector<Check> all_checks() {
  const std::string page = page_folder();
  return {
      {"version",
       Finding::kOk,
       fmt::format("pointflight {} ({})", kVersion, POINTFLIGHT_COMMIT),
       ""},
      check_processor(),
      check_memory(),
      check_data(),
      check_folder(),
      check_gpu(),
      check_part("meshes",
                 POINTFLIGHT_WITH_MESHES != 0,
                 "read by assimp",
                 "build where libassimp-dev is installed"),
      check_part("page", !page.empty(), page, "--view needs npm when it is built: ./dev build"),
      check_ros1(),
      check_ros2(),
      check_part("shared runs",
                 has_module("pointflight_dds"),
                 "fly --share",
                 "build where cyclonedds-dev is installed"),
      check_network(),
      check_buffers(),
      check_part("MPI",
                 has_module("pointflight_mpi"),
                 "campaign --engine mpi",
                 "only for clusters: build where libopenmpi-dev is installed"),
  };
}

int examine(bool as_json) {
  constexpr const char* kNames[] = {"ok", "note", "TROUBLE"};
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  bool has_trouble = false;
  for (const Check& check : all_checks()) {
    const char* name = kNames[static_cast<int>(check.finding)];
    has_trouble = has_trouble || check.finding == Finding::kTrouble;
    if (as_json) {
      json.push_back({{"what", check.what},
                      {"finding", name},
                      {"said", check.said},
                      {"remedy", check.remedy}});
      continue;
    }
    fmt::print("{:<8} {:<12} {}\n", name, check.what, check.said);
    if (!check.remedy.empty()) fmt::print("{:<21} -> {}\n", "", check.remedy);
  }
  if (as_json) print_json(json);
  return has_trouble ? kRanButFailed : kDone;
}

}  // namespace

void add_doctor_command(CLI::App& parent, int& exit_code) {
  auto* app = parent.add_subcommand(
      "doctor", "What this machine and this build have and lack, and what to do about it");
  auto as_json = std::make_shared<bool>(false);
  app->add_flag("--json", *as_json, "JSON on stdout");
  app->callback([as_json, &exit_code] { exit_code = examine(*as_json); });
}

}  // namespace pointflight::apps
