#include "pointflight/sim/interrupted_run.hpp"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "pointflight/core/input_error.hpp"
#include "pointflight/sim/run_folder.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

/// A file itself: a link would lead to somebody else's.
bool is_file(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(fs::symlink_status(path, ignored));
}

/// The last bytes of a file as whole lines.
std::vector<std::string> last_lines(const fs::path& path, std::size_t most) {
  if (!is_file(path)) return {};
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return {};
  const auto size = static_cast<std::size_t>(file.tellg());
  const std::size_t taken = std::min(size, most);
  file.seekg(static_cast<std::streamoff>(size - taken));
  std::string text(taken, '\0');
  file.read(text.data(), static_cast<std::streamsize>(taken));
  std::vector<std::string> lines;
  for (std::size_t at = 0;;) {
    const std::size_t end = text.find('\n', at);
    if (end == std::string::npos) break;  // half a line
    lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  if (!lines.empty()) lines.erase(lines.begin());  // half a line, or the columns' names
  return lines;
}

/// A row of trajectory.csv.
std::optional<std::pair<SimTime, VehicleState>> state_in(const std::string& line,
                                                         std::size_t rotors) {
  constexpr std::size_t kBefore = 1 + 13 + 3 + 2;  // time, state, command, nearest
  std::vector<double> values;
  const char* at = line.c_str();
  for (;;) {
    char* end = nullptr;
    values.push_back(std::strtod(at, &end));
    if (*end == '\0') break;
    if (*end != ',') return std::nullopt;
    at = end + 1;
  }
  if (values.size() != kBefore + rotors) return std::nullopt;
  VehicleState state;
  state.body.p_world = Vector3d(&values[1]);
  state.body.q_world_body = Quaterniond(values[4], values[5], values[6], values[7]);
  state.body.v_world = Vector3d(&values[8]);
  state.body.omega_body = Vector3d(&values[11]);
  for (std::size_t i = 0; i < rotors; ++i) state.rotors.push_back({values[kBefore + i], 0.0});
  if (!state.body.is_finite() || !(values[0] >= 0.0 && values[0] < 1e6)) return std::nullopt;
  if (!(std::abs(state.body.q_world_body.norm() - 1.0) < 1e-3)) return std::nullopt;
  return std::pair(SimTime(from_seconds(values[0])), state);
}

}  // namespace

std::optional<InterruptedRun> ended_run(const std::string& folder,
                                        const Simulation& simulation,
                                        const std::vector<std::size_t>& vehicles) {
  constexpr std::size_t kRead = 1 << 17;
  const fs::path staging = killed_run_in(folder);
  std::map<std::size_t, std::map<SimTime, VehicleState>> known;
  InterruptedRun ended{{}, SimTime::max(), Duration{0}, {}};
  std::int64_t skipped = 0;
  if (!is_file(staging / kSkippedFile) || !is_file(staging / "scenario.yaml")) return std::nullopt;
  if (!(std::ifstream(staging / kSkippedFile) >> skipped)) return std::nullopt;
  ended.skipped = Duration(skipped);
  try {
    ended.scenario = load_scenario((staging / "scenario.yaml").string());
  } catch (const InputError&) {
    return std::nullopt;  // killed before it was written, or by another version
  }
  for (const std::size_t v : vehicles) {
    const VehicleAgent& agent = simulation.vehicle(v);
    const std::string name = simulation.vehicle_count() == 1 ? "" : agent.setup().name;
    const fs::path path = staging / name / "trajectory.csv.partial";
    const std::size_t rotors = agent.settings().rotors.size();
    for (const std::string& line : last_lines(path, kRead)) {
      if (auto row = state_in(line, rotors)) known[v].insert(std::move(*row));
    }
    if (known[v].empty()) return std::nullopt;
    ended.time = std::min(ended.time, known[v].rbegin()->first);
  }
  if (ended.skipped < Duration{0} || SimTime{} + ended.skipped > ended.time) return std::nullopt;
  // instants of the truth may lie within a step
  const Duration step = from_seconds(simulation.scenario().physics_step);
  const SimTime within = ended.time;
  ended.time -= ended.time.time_since_epoch() % step;
  for (auto& [v, states] : known) {
    const auto found = states.find(within);
    if (found == states.end()) return std::nullopt;
    ended.states.emplace(v, found->second);
  }
  return ended;
}

}  // namespace pointflight
