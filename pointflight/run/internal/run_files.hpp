// The tables that a run leaves in its folder, read with care: numbers, times, positions, words.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "pointflight/core/time.hpp"
#include "pointflight/io/csv_table.hpp"
#include "pointflight/map/body.hpp"
#include "pointflight/vehicle/state.hpp"

namespace pointflight {

/// True for a file with a line beyond that of its columns' names.
bool has_rows(const std::filesystem::path& path);
/// Throws InputError if it is none of a run.
SimTime time_at(const CsvTable& table, std::size_t row, int column);
/// As `time_at`.
Label label_at(const CsvTable& table, std::size_t row, int column);
Vector3d vector_at(const CsvTable& table, std::size_t row, int column);
/// w, x, y, z from a column on.
Quaterniond rotation_at(const CsvTable& table, std::size_t row, int column);
/// px ... wz from a column on.
RigidBodyState body_at(const CsvTable& table, std::size_t row, int column);
/// Lines of a file as words between commas, without the first line. Throws InputError if there
/// is no such file.
std::vector<std::vector<std::string>> words_of(const std::string& path);
/// When the run ended, by its summary.json. Throws InputError.
SimTime ended_at(const std::filesystem::path& path);

/// Names of vehicles that other processes flew, by summary.json; none if it does not say.
std::set<std::string> vehicles_of_others(const std::filesystem::path& path);
/// 0 if it is empty. Throws InputError, with the file's name, if it is no number of a run.
double number_in(const std::string& word, const std::string& path);
/// A whole number from 0 on.
std::uint64_t count_in(const std::string& word, const std::string& path);
/// As `time_at`.
SimTime time_in(const std::string& word, const std::string& path);

}  // namespace pointflight
