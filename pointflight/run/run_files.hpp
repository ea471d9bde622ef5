// The tables that a run leaves in its folder, read with care: numbers, times, places, words.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "pointflight/core/time.hpp"
#include "pointflight/io/csv_table.hpp"
#include "pointflight/map/body.hpp"
#include "pointflight/vehicle/state.hpp"

namespace pointflight {

SimTime time_at(const CsvTable& table, std::size_t row, int column);
Label label_at(const CsvTable& table, std::size_t row, int column);
Vector3d vector_at(const CsvTable& table, std::size_t row, int column);
/// w, x, y, z from a column on.
Quaterniond rotation_at(const CsvTable& table, std::size_t row, int column);
/// px ... wz from a column on.
RigidBodyState body_at(const CsvTable& table, std::size_t row, int column);
/// Lines of a file as words between commas, without the first line. Throws InputError where there
/// is none.
std::vector<std::vector<std::string>> words_of(const std::string& path);
/// What summary.json says.
SimTime ended_at(const std::filesystem::path& path);
/// 0 where it is empty. Throws InputError, with the file's name, where it is no number of a run.
double number_in(const std::string& word, const std::string& path);
/// A whole number from 0 on.
std::uint64_t count_in(const std::string& word, const std::string& path);
/// As `time_at`.
SimTime time_in(const std::string& word, const std::string& path);

}  // namespace pointflight
