#include "pointflight/run/run_files.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/whole_number.hpp"

namespace pointflight {
namespace {

/// Longer than any run may last, s.
constexpr double kTimeMax = 2e6;
/// Beyond every place that a run comes to, m; also of other quantities.
constexpr double kGreatestOfRun = 1e9;

[[noreturn]] void refuse(const std::string& at, const std::string& what) {
  throw InputError(fmt::format("{}: {}; the file was changed or damaged", at, what));
}

SimTime checked_time(double time, const std::string& at) {
  if (time >= 0.0 && time <= kTimeMax) return SimTime(from_seconds(time));
  refuse(at, fmt::format("{} s is no time of a run", time));
}

Vector3d checked_position(const Vector3d& p, const std::string& at) {
  // NaN is not within
  if ((p.array().abs() <= kGreatestOfRun).all()) return p;
  refuse(at, fmt::format("({}, {}, {}) is no position of a run", p.x(), p.y(), p.z()));
}

Quaterniond checked_rotation(const Quaterniond& q, const std::string& at) {
  // as it was written, digit for digit, and not made a unit again
  if (std::abs(q.norm() - 1.0) < 0.01) return q;
  refuse(at, "the rotation is no unit quaternion");
}

Label checked_label(double label, const std::string& at) {
  if (const auto whole = whole_number<Label>(label)) return *whole;
  refuse(at, fmt::format("{} is no label", label));
}

nlohmann::json json_of(const std::filesystem::path& path) {
  const MappedFile file(path.string());
  return nlohmann::json::parse(file.text().begin(), file.text().end(), nullptr, false);
}

}  // namespace

bool has_rows(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return false;
  const MappedFile file(path.string());
  LineCursor lines(file.text());
  std::string_view line;
  return lines.next(line) && lines.next(line);
}

SimTime time_at(const CsvTable& table, std::size_t row, int column) {
  return checked_time(table.at(row, column), table.location(row));
}

Label label_at(const CsvTable& table, std::size_t row, int column) {
  return checked_label(table.at(row, column), table.location(row));
}

Vector3d position_at(const CsvTable& table, std::size_t row, int column) {
  const Vector3d p(table.at(row, column), table.at(row, column + 1), table.at(row, column + 2));
  return checked_position(p, table.location(row));
}

Vector3d vector_at(const CsvTable& table, std::size_t row, int column) {
  Vector3d v;
  for (int axis = 0; axis < 3; ++axis) {
    v[axis] = table.at(row, column + axis);
    if (std::abs(v[axis]) > kGreatestOfRun) {
      refuse(table.location(row), fmt::format("{} is no value of a run", v[axis]));
    }
  }
  return v;
}

Quaterniond rotation_at(const CsvTable& table, std::size_t row, int column) {
  const auto at = [&](int i) { return table.at(row, column + i); };
  return checked_rotation({at(0), at(1), at(2), at(3)}, table.location(row));
}

RigidBodyState body_at(const CsvTable& table, std::size_t row, int column) {
  RigidBodyState body;
  body.p_world = position_at(table, row, column);
  body.q_world_body = rotation_at(table, row, column + 3);
  body.v_world = vector_at(table, row, column + 7);
  body.omega_body = vector_at(table, row, column + 10);
  return body;
}

WordTable::WordTable(const std::string& path, std::size_t columns)
    : file_(path), lines_(file_.text()), columns_(columns) {
  std::string_view names;
  lines_.next(names);
}

bool WordTable::next() {
  std::string_view line;
  if (!lines_.next(line)) return false;
  words_.clear();
  for (std::size_t comma = line.find(','); comma != std::string_view::npos;
       comma = line.find(',')) {
    words_.push_back(line.substr(0, comma));
    line.remove_prefix(comma + 1);
  }
  words_.push_back(line);
  if (words_.size() >= columns_) return true;
  refuse(at(), fmt::format("{} columns where a run writes {}", words_.size(), columns_));
}

std::string WordTable::at() const {
  return fmt::format("{}:{}", file_.path(), lines_.number());
}

double WordTable::number_of(std::string_view text) const {
  constexpr double kMost = 1e15;
  double value = 0.0;
  if (text.empty() || (parse_number(text, value) && std::abs(value) <= kMost)) return value;
  refuse(at(), fmt::format("'{}' is no number of a run", excerpt(text)));
}

double WordTable::number(std::size_t column) const {
  return number_of(word(column));
}

std::uint64_t WordTable::count_of(std::string_view text) const {
  if (const auto count = whole_number<std::uint64_t>(number_of(text))) return *count;
  refuse(at(), fmt::format("'{}' is no count", excerpt(text)));
}

std::uint32_t WordTable::index(std::string_view text, std::size_t end, const char* what) const {
  const std::uint64_t number = count_of(text);
  if (number < end && number <= UINT32_MAX) return static_cast<std::uint32_t>(number);
  refuse(at(), fmt::format("the scenario has no {} {}", what, number));
}

SimTime WordTable::time(std::size_t column) const {
  return checked_time(number(column), at());
}

Vector3d WordTable::position(std::size_t column) const {
  return checked_position({number(column), number(column + 1), number(column + 2)}, at());
}

Label WordTable::label(std::size_t column) const {
  return checked_label(number(column), at());
}

Pose WordTable::pose(std::size_t column) const {
  const auto q = [&](std::size_t i) { return number(column + 3 + i); };
  return {checked_rotation({q(0), q(1), q(2), q(3)}, at()), position(column)};
}

SimTime ended_at(const std::filesystem::path& path) {
  const auto json = json_of(path);
  if (!json.is_object() || !json.contains("simulated_time") ||
      !json["simulated_time"].is_number()) {
    throw InputError(fmt::format("{}: is no summary of a run", path.string()));
  }
  return checked_time(json["simulated_time"].get<double>(), path.string() + ": simulated_time");
}

std::set<std::string> vehicles_of_others(const std::filesystem::path& path) {
  const auto json = json_of(path);
  std::set<std::string> names;
  if (!json.is_object() || !json.contains("others") || !json["others"].is_array()) return names;
  for (const auto& other : json["others"]) {
    if (other.is_object() && other.contains("name") && other["name"].is_string()) {
      names.insert(other["name"].get<std::string>());
    }
  }
  return names;
}

}  // namespace pointflight
