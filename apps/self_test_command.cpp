#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/settings_json.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/core/version.hpp"
#include "pointflight/render/instruction_sets.hpp"
#include "pointflight/sim/self_test.hpp"

namespace pointflight::apps {
namespace {

struct SelfTestFlags {
  bool json = false;
  bool write = false;
  int threads = 0;
};

/// What a machine computes with each of its instruction sets, beside the release.
struct SelfTestRow {
  std::string instruction_set;
  std::vector<SelfTestHash> hashes;
};

std::string expected_of(const std::vector<SelfTestHash>& released, const std::string& what) {
  for (const SelfTestHash& hash : released) {
    if (hash.what == what) return hash.hash;
  }
  return "";
}

int compare_with_release(const SelfTestFlags& flags, const std::vector<SelfTestRow>& rows) {
  const std::vector<SelfTestHash> released = released_hashes();
  nlohmann::ordered_json json;
  json["version"] = kVersion;
  bool is_same = true;
  for (const SelfTestRow& row : rows) {
    std::string differing;
    for (const SelfTestHash& hash : row.hashes) {
      json["hashes"][row.instruction_set][hash.what] = hash.hash;
      if (hash.hash == expected_of(released, hash.what)) continue;
      differing += (differing.empty() ? "" : ", ") + hash.what;
    }
    is_same = is_same && differing.empty();
    if (flags.json) continue;
    fmt::print("{:<12} {}\n",
               row.instruction_set,
               differing.empty() ? "the same bytes as the release: map, states, imu, scans"
                                 : "other bytes than the release: " + differing);
  }
  json["same"] = is_same;
  if (flags.json) {
    print_json(json);
  } else {
    fmt::print(
        "{}\n",
        is_same
            ? fmt::format("this machine computes what pointflight {} computes elsewhere", kVersion)
            : "results of this machine cannot be compared bit by bit with those of others: "
              "please report it, with the output of `pointflight doctor`");
  }
  return is_same ? kDone : kRanButFailed;
}

int run_self_test(const SelfTestFlags& flags) {
  const Executor executor(flags.threads);
  std::vector<SelfTestRow> rows;
  for (const std::string& name : instruction_sets()) {
    use_instruction_set(name);
    rows.push_back({name, self_test(executor, terminal_progress())});
    end_progress();
  }
  use_instruction_set("");
  if (!flags.write) return compare_with_release(flags, rows);
  OutputFile file((std::filesystem::path(data_folder()) / "self_test.csv").string());
  file.write(self_test_file(rows.front().hashes));
  file.commit();
  return kDone;
}

}  // namespace

void add_self_test_command(CLI::App& parent, int& exit_code) {
  auto* app = parent.add_subcommand(
      "self-test", "Flies and renders for a few seconds: the same bytes as everywhere?");
  auto flags = std::make_shared<SelfTestFlags>();
  app->add_option("--threads", flags->threads, "0: all cores; results never depend on it")
      ->check(CLI::Range(0, 1024));
  app->add_flag("--json", flags->json, "JSON on stdout");
  app->add_flag("--write", flags->write, "For developers: renew data/self_test.csv");
  app->callback([flags, &exit_code] { exit_code = run_self_test(*flags); });
}

}  // namespace pointflight::apps
