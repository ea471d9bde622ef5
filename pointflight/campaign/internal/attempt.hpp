// A flight of a campaign while it is flown, and the names of what is in a campaign's folder.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "pointflight/campaign/run_record.hpp"
#include "pointflight/core/folder.hpp"
#include "pointflight/core/owned_files.hpp"

namespace pointflight {

inline constexpr const char* kFlightResult = "result.json";
inline constexpr const char* kFlightAttempt = ".attempt-";
inline constexpr const char* kFlights = "runs";
inline constexpr const char* kFlightOutput = "output";  ///< Of a flight: what its program writes.

/// Writes a file of ours. Throws InputError.
void write_text(const std::filesystem::path& path, std::string_view text);

/// Of this machine; "host" if it does not say.
std::string host_name();

/// Of a flight in the campaign's folder.
std::string flight_name(std::size_t number);

/// Removes what we and our own `fly` wrote for a flight. Returns true if that was all: what a
/// program of the user's left there stays.
bool remove_flight(const Folder& home, const std::string& name);

/// A flight while it is flown, in a folder of its own. One that ends without a result leaves
/// nothing of ours.
class Attempt {
 public:
  Attempt(const Folder& home, std::size_t number);
  ~Attempt();
  Attempt(const Attempt&) = delete;
  Attempt& operator=(const Attempt&) = delete;

  [[nodiscard]] OwnedFolder& folder() { return folder_; }

  /// Takes away what a thousand flights need not keep of a run that lists its files.
  void remove_bulk(const std::string& figures) const;

  /// It is over: its folder gets the flight's name.
  void keep(const RunRecord& record);

 private:
  const Folder& home_;
  std::size_t number_;
  std::string name_;
  OwnedFolder folder_;
  bool kept_ = false;
};

}  // namespace pointflight
