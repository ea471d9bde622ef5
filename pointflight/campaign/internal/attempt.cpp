#include "pointflight/campaign/internal/attempt.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <optional>
#include <set>
#include <system_error>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/sim/run_folder.hpp"

namespace pointflight {
namespace {

/// Of an attempt at it: it says whose it is.
std::string attempt_name(std::size_t number) {
  static std::atomic<int> count = 0;
  return fmt::format(
      "{}{}{}-{}-{}", flight_name(number), kFlightAttempt, host_name(), getpid(), ++count);
}

/// What has no result is no flight, and what is not ours stays: under another name.
void make_way(const Folder& home, const std::string& name) {
  if (home.entry(name + "/" + kFlightResult) != Entry::kNothing || remove_flight(home, name))
    return;
  for (int i = 1; home.rename(name, home, fmt::format("{}.aside-{}", name, i)) == EEXIST; ++i) {
  }
}

}  // namespace

std::string host_name() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) return "host";
  return name.data();
}

void write_text(const fs::path& path, std::string_view text) {
  OutputFile file(path.string());
  file.write(text);
  file.commit();
}

std::string flight_name(std::size_t number) {
  return fmt::format("{}/{:06}", kFlights, number);
}

bool remove_flight(const Folder& home, const std::string& name) {
  if (const auto flight = home.below(name)) remove_run(*flight, kFlightOutput);
  return remove_owned(home, name);
}

Attempt::Attempt(const Folder& home, std::size_t number)
    : home_(home), number_(number), name_(attempt_name(number)), folder_(home, name_) {}

Attempt::~Attempt() {
  if (kept_) return;
  try {
    remove_flight(home_, name_);
  } catch (...) {  // NOLINT(bugprone-empty-catch): without memory, say; `remove_leftovers` does it
  }
}

void Attempt::remove_bulk(const std::string& figures) const {
  const auto output = folder_.folder().below(kFlightOutput);
  auto files = output ? read_file_list(*output) : std::nullopt;
  if (!files) return;
  const std::set<std::string> kept = {"summary.json", "timing.json", "events.csv", figures};
  remove_listed(*output, *files, [&](const std::string& name) { return kept.contains(name); });
  std::erase_if(*files, [&](const ListedFile& file) { return !kept.contains(file.name); });
  output->write(kFileList, file_list_text(*files));
}

void Attempt::keep(const RunRecord& record) {
  write_text(folder_.file(kFlightResult), record_json(record));
  const std::string name = flight_name(number_);
  make_way(home_, name);
  const int error = home_.rename(name_, home_, name);
  const bool is_flown = home_.entry(name + "/" + kFlightResult) == Entry::kFile;
  if (error == EEXIST && is_flown) return;  // by somebody else meanwhile: the same
  if (error != 0) {
    throw InputError(
        fmt::format("{}/{}: {}", home_.path(), name, std::generic_category().message(error)));
  }
  kept_ = true;
}

}  // namespace pointflight
