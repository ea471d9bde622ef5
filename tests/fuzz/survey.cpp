// Any bytes as the poses ("P") or a scan ("S") of a survey: rays, or an InputError of one line.
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "pointflight/core/input_error.hpp"
#include "pointflight/survey/posed_scans.hpp"
#include "pointflight/survey/supported_cells.hpp"
#include "tests/fuzz/temporary_folder.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

void write(const fs::path& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

constexpr std::string_view kScan =
    "VERSION 0.7\nFIELDS x y z time\nSIZE 4 4 4 8\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 1\nHEIGHT 1\n"
    "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1\nDATA ascii\n3 0 0 0.5\n";

class FolderOnDisk {
 public:
  FolderOnDisk() {
    fs::create_directories(path_ / "scans");
    put('S', kScan);
    put('P', "0 0 0 1 0 0 0 1\n1 1 0 1 0 0 0 1\n");
    write(path_ / "scans/1.5.pcd", kScan);
  }
  void put(char what, std::string_view bytes) const {
    write(path_ / (what == 'P' ? "poses" : "scans/0.5.pcd"), bytes);
  }
  [[nodiscard]] SurveyFiles files() const {
    return {(path_ / "scans").string(), (path_ / "poses").string(), "", false};
  }

 private:
  FuzzFolder folder_;
  fs::path path_ = folder_.path();
};

}  // namespace
}  // namespace pointflight

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace pointflight;
  if (size == 0 || (data[0] != 'P' && data[0] != 'S')) return 0;
  const FolderOnDisk folder;
  const auto what = static_cast<char>(data[0]);
  folder.put(what, {reinterpret_cast<const char*>(data) + 1, size - 1});
  try {
    const SurveyFolder survey(folder.files());
    const auto reader = survey.open();
    std::vector<SurveyRay> batch;
    SupportedCells places;
    while (reader->read(batch)) {
      for (const SurveyRay& ray : batch) {
        if (!ray.origin_world.allFinite() || !std::isfinite(ray.range)) __builtin_trap();
        if (!(std::abs(ray.direction_world.norm() - 1.0f) <= 1e-3f)) __builtin_trap();
        places.add(ray.point_world());
        if (!places.has(ray.point_world()) && ray.point_world().norm() < 1e6) __builtin_trap();
      }
    }
  } catch (const InputError& error) {
    const std::string text = error.what();
    if (text.empty() || text.find('\n') != std::string::npos) __builtin_trap();
  }
  return 0;
}
