#include "pointflight/run/internal/run_files.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

/// Longer than any run may last, s.
constexpr double kTimeMax = 2e6;

}  // namespace

bool has_rows(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string line;
  return std::getline(file, line) && std::getline(file, line);
}

SimTime time_at(const CsvTable& table, std::size_t row, int column) {
  const double time = table.at(row, column);
  if (!(time >= 0.0 && time <= kTimeMax)) {
    throw InputError(fmt::format("{}: no time of a run", table.location(row)));
  }
  return SimTime(from_seconds(time));
}

Label label_at(const CsvTable& table, std::size_t row, int column) {
  const double label = table.at(row, column);
  if (label >= 0.0 && label <= 4e9) return static_cast<Label>(label);
  throw InputError(fmt::format("{}: no label", table.location(row)));
}

Vector3d vector_at(const CsvTable& table, std::size_t row, int column) {
  return {table.at(row, column), table.at(row, column + 1), table.at(row, column + 2)};
}

Quaterniond rotation_at(const CsvTable& table, std::size_t row, int column) {
  return {table.at(row, column),
          table.at(row, column + 1),
          table.at(row, column + 2),
          table.at(row, column + 3)};
}

RigidBodyState body_at(const CsvTable& table, std::size_t row, int column) {
  RigidBodyState body;
  body.p_world = vector_at(table, row, column);
  body.q_world_body = rotation_at(table, row, column + 3);
  body.v_world = vector_at(table, row, column + 7);
  body.omega_body = vector_at(table, row, column + 10);
  return body;
}

std::vector<std::vector<std::string>> words_of(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw InputError(fmt::format("{}: cannot open; is it a run's folder?", path));
  std::vector<std::vector<std::string>> rows;
  std::string line;
  for (std::getline(file, line); std::getline(file, line);) {
    std::vector<std::string>& words = rows.emplace_back(1);
    for (const char c : line) {
      if (c == ',') {
        words.emplace_back();
      } else {
        words.back() += c;
      }
    }
  }
  return rows;
}

SimTime ended_at(const std::filesystem::path& path) {
  std::ifstream file(path);
  const auto json = nlohmann::json::parse(file, nullptr, false);
  if (!json.is_object() || !json.contains("simulated_time") ||
      !json["simulated_time"].is_number()) {
    throw InputError(fmt::format("{}: is missing or no summary of a run", path.string()));
  }
  const auto time = json["simulated_time"].get<double>();
  if (!(time >= 0.0 && time <= kTimeMax)) {
    throw InputError(fmt::format("{}: simulated_time: {} s", path.string(), time));
  }
  return SimTime(from_seconds(time));
}

std::set<std::string> vehicles_of_others(const std::filesystem::path& path) {
  std::ifstream file(path);
  const auto json = nlohmann::json::parse(file, nullptr, false);
  std::set<std::string> names;
  if (!json.is_object() || !json.contains("others") || !json["others"].is_array()) return names;
  for (const auto& other : json["others"]) {
    if (other.is_object() && other.contains("name") && other["name"].is_string()) {
      names.insert(other["name"].get<std::string>());
    }
  }
  return names;
}

double number_in(const std::string& word, const std::string& path) {
  if (word.empty()) return 0.0;
  char* end = nullptr;
  const double value = std::strtod(word.c_str(), &end);
  if (*end == '\0' && std::abs(value) <= 1e15) return value;
  throw InputError(fmt::format("{}: '{}' is no number", path, word));
}

std::uint64_t count_in(const std::string& word, const std::string& path) {
  const double value = number_in(word, path);
  if (value < 0.0) throw InputError(fmt::format("{}: '{}' is negative", path, word));
  return static_cast<std::uint64_t>(value);
}

SimTime time_in(const std::string& word, const std::string& path) {
  const double time = number_in(word, path);
  if (time >= 0.0 && time <= kTimeMax) return SimTime(from_seconds(time));
  throw InputError(fmt::format("{}: '{}' is no time of a run", path, word));
}

}  // namespace pointflight
