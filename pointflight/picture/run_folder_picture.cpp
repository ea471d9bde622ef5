#include "pointflight/picture/run_folder_picture.hpp"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/owned_files.hpp"
#include "pointflight/core/whole_number.hpp"
#include "pointflight/io/cloud_reader.hpp"
#include "pointflight/io/csv_table.hpp"
#include "pointflight/run/run_files.hpp"
#include "pointflight/sim/run_folder.hpp"

namespace pointflight::picture {
namespace {

namespace fs = std::filesystem;

bool is_there(const fs::path& path) {
  std::error_code ignored;  // of names that no file can have
  return fs::exists(path, ignored);
}

void read_vehicle(const fs::path& folder, std::size_t number, RunPicture& picture) {
  const CsvTable table((folder / "trajectory.csv").string());
  const int x = table.require("px");
  if (table.require("py") != x + 1 || table.require("pz") != x + 2) {
    throw InputError(fmt::format("{}: columns px, py, pz are wanted, one beside the other",
                                 (folder / "trajectory.csv").string()));
  }
  for (std::size_t row = 0; row < table.rows(); ++row) {
    picture.add_path_point(number, position_at(table, row, x));
  }
  const fs::path scans = folder / "scans.csv";
  if (!is_there(scans)) return;
  std::size_t offered = 0;
  const Folder own(folder.string());
  for (WordTable rows(scans.string(), 14); rows.next();) {
    const Pose T_world_sensor = rows.pose(7);
    const auto reader = open_cloud(file_of_run(own, std::string(rows.word(0)), scans.string()));
    std::vector<CloudPoint> points;
    while (reader->read(points)) {
      for (const CloudPoint& point : points) {
        if (offered++ % RunPicture::kSeenStride == 0) {
          picture.seen.add(T_world_sensor * point.position);
        }
      }
    }
  }
}

/// A figure of a summary, from 0 on. Throws std::out_of_range if it is none that runs come to.
double figure_of(const nlohmann::json& object, const char* key) {
  const auto value = object.at(key).get<double>();
  if (value >= 0.0 && value <= 1e12) return value;
  throw std::out_of_range(fmt::format("{}: {}", key, value));
}

std::uint64_t count_of(const nlohmann::json& object, const char* key) {
  const auto count = whole_number<std::uint64_t>(figure_of(object, key));
  if (count) return *count;
  throw std::out_of_range(fmt::format("{}: {}", key, figure_of(object, key)));
}

}  // namespace

RunPicture read_run_picture(const std::string& run) {
  const fs::path folder(run);
  RunPicture picture;
  try {
    const MappedFile file((folder / "summary.json").string());
    const auto summary = nlohmann::json::parse(file.text().begin(), file.text().end());
    const auto& vehicles = summary.at("vehicles");
    RunFigures figures;
    figures.vehicles = vehicles.size();
    if (summary.contains("others")) figures.others = summary.at("others").size();
    figures.time = figure_of(summary, "simulated_time");
    figures.end = summary.at("end").get<std::string>();
    for (const auto& vehicle : vehicles) {
      const std::string name = vehicle.at("name").get<std::string>();
      // one of several, if other processes flew the rest
      const bool has_folder = is_there(folder / name / "trajectory.csv");
      read_vehicle(has_folder ? folder / name : folder, picture.names.size(), picture);
      picture.names.push_back(name);
      figures.flown += figure_of(vehicle, "distance_flown");
      figures.scans += count_of(vehicle, "scans");
      figures.points += count_of(vehicle, "points");
      figures.collisions += count_of(vehicle, "collisions");
      if (vehicle.at("closest_approach").is_number()) {
        figures.add_closest(vehicle.at("closest_approach").get<double>());
      }
    }
    write_titles(figures, picture);
  } catch (const nlohmann::json::exception&) {
    throw InputError(fmt::format("{}: not the summary of a run; give the folder of `fly -o`",
                                 (folder / "summary.json").string()));
  } catch (const std::out_of_range& figure) {
    throw InputError(fmt::format("{}: {} is no figure of a run; the file was changed or damaged",
                                 (folder / "summary.json").string(),
                                 figure.what()));
  }
  const fs::path obstacles = folder / "obstacles.csv";
  if (is_there(obstacles)) {
    for (WordTable rows(obstacles.string(), 12); rows.next();) {
      picture.add_obstacle(rows.label(1), rows.position(2), rows.position(9).x());
    }
  }
  for (WordTable rows((folder / "events.csv").string(), 11); rows.next();) {
    if (rows.word(1) == "collision") picture.collisions.add(rows.position(7));
  }
  return picture;
}

}  // namespace pointflight::picture
