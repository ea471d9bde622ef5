#include <fmt/format.h>

#include <memory>
#include <string>

#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/flags.hpp"
#include "apps/input_kind.hpp"
#include "apps/settings_json.hpp"
#include "apps/terminal.hpp"
#include "pointflight/campaign/study.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/sim/scenario.hpp"

namespace pointflight::apps {
namespace {

struct NewStudyFlags {
  std::string scenario;
  std::string output;
  bool force = false;
};

void new_study(const NewStudyFlags& flags) {
  require_kind(flags.scenario, {InputKind::kYaml}, "a scenario (.yaml)");
  check_outputs({flags.output}, {flags.scenario}, flags.force);
  load_scenario(flags.scenario);
  OutputFile file(flags.output);
  file.write("# A pointflight study; every key: docs/campaigns.md, or pointflight study keys\n" +
             study_template(path_in_file(flags.output, flags.scenario)));
  file.commit();
  log(fmt::format("ten flights; fly them: pointflight campaign {} -o results", flags.output));
  fmt::print("{}\n", flags.output);
}

}  // namespace

void add_study_command(CLI::App& parent, int& /*exit_code*/) {
  auto* app = parent.add_subcommand("study", "Make study files, which `campaign` flies");
  app->require_subcommand(1);
  auto* make = app->add_subcommand("new", "A commented study of ten seeds of a scenario");
  auto flags = std::make_shared<NewStudyFlags>();
  make->add_option("scenario", flags->scenario, "A .yaml")->required();
  make->add_option("-o,--output", flags->output, "The .yaml to write")->required();
  add_force_flag(*make, flags->force);
  make->callback([flags] { new_study(*flags); });

  auto* keys = app->add_subcommand(
      "keys", "All keys of a study file as a Markdown table (docs/campaigns.md)");
  keys->callback([] { print_reference(study_reference()); });
}

}  // namespace pointflight::apps
