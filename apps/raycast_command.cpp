#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "apps/commands.hpp"
#include "apps/flags.hpp"
#include "apps/named_map.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/spool.hpp"
#include "pointflight/render/ray_casting.hpp"
#include "pointflight/scenes/scene_tree.hpp"
#include "pointflight/scenes/world_map.hpp"

namespace pointflight::apps {
namespace {

struct RaycastFlags {
  std::string place;
  std::string rays;
  std::string output;
  double range_max = 1000.0;
  bool exact = false;
  bool force = false;
  int threads = 0;
};

/// What a ray hits.
struct Answer {
  float range = -1.0f;         ///< m; negative: nothing.
  float cos_incidence = 0.0f;  ///< |cos|
  float reflectivity = -1.0f;  ///< Negative: not known.
  std::string kind;            ///< Empty: not known.
  std::uint32_t thing = 0;
};

/// Six numbers a line: origin, m, and direction, of any length.
std::vector<Ray> rays_in(std::string_view text, const std::string& name, double range_max) {
  std::vector<Ray> rays;
  LineCursor lines(text);
  std::string_view line;
  while (lines.next(line)) {
    const auto first = line.find_first_not_of(" \t");
    if (first == std::string_view::npos || line[first] == '#') continue;
    double numbers[6] = {};
    for (double& number : numbers) {
      const std::string_view word = take_word(line);
      if (!parse_number(word, number) || !std::isfinite(number)) {
        throw InputError(fmt::format(
            "{}:{}: a ray is six numbers, x y z dx dy dz (m, world)", name, lines.number()));
      }
    }
    if (!take_word(line).empty()) {
      throw InputError(
          fmt::format("{}:{}: more than the six numbers of a ray", name, lines.number()));
    }
    const Vector3d direction(numbers[3], numbers[4], numbers[5]);
    if (direction.norm() < 1e-9) {
      throw InputError(fmt::format("{}:{}: the direction has no length", name, lines.number()));
    }
    rays.push_back({{numbers[0], numbers[1], numbers[2]},
                    direction.normalized().cast<float>(),
                    static_cast<float>(range_max)});
  }
  if (rays.empty()) throw InputError(fmt::format("{}: no ray in it", name));
  return rays;
}

std::vector<Ray> read_rays(const RaycastFlags& flags) {
  if (flags.rays != "-") {
    const MappedFile file(flags.rays);
    return rays_in(file.text(), flags.rays, flags.range_max);
  }
  const MappedFile file(*spool(0, "standard input", {}, {}), "standard input");
  return rays_in(file.text(), "standard input", flags.range_max);
}

/// The scene behind a map of `world make`, a world's name, or a scene of `fidelity`.
ExactScene exact_scene_of(const std::string& place) {
  if (const auto world = world_in(place)) return make_world(world->world);
  if (!place.ends_with(".pfmap")) return load_scene(place);
  const auto world = world_of(*SurfelMap::open(place));
  if (world) return make_world(world->world);
  throw InputError(fmt::format(
      "{}: what it is exactly is known of maps that `pointflight world make` has made", place));
}

std::vector<Answer> cast_exactly(const RaycastFlags& flags, const std::vector<Ray>& rays) {
  const ExactScene scene = exact_scene_of(flags.place);
  const SceneTree tree(scene);
  std::vector<Answer> answers(rays.size());
  Executor(flags.threads).parallel_for(rays.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vector3d direction = rays[i].direction_world.cast<double>();
      const auto hit = tree.intersect(rays[i].origin_world, direction);
      if (!hit || hit->range > flags.range_max) continue;
      const Vector3d p = rays[i].origin_world + hit->range * direction;
      const Vector3d normal = normal_at(scene.geometry.shapes[hit->shape], p);
      Answer& answer = answers[i];
      answer.range = static_cast<float>(hit->range);
      answer.cos_incidence = static_cast<float>(std::abs(normal.dot(direction)));
      answer.kind = scene.tags[scene.shape_tag[hit->shape]];
      if (!scene.shape_object.empty()) answer.thing = scene.shape_object[hit->shape];
      if (!scene.shape_reflectivity.empty()) {
        answer.reflectivity = scene.shape_reflectivity[hit->shape];
      }
    }
  });
  return answers;
}

std::vector<Answer> cast_into_map(const RaycastFlags& flags, const std::vector<Ray>& rays) {
  const auto map = open_named_map(flags.place);
  const auto renderer = make_renderer("beam", Scene{map});
  std::vector<Hit> hits(rays.size());
  cast_rays(*renderer, rays, hits, Executor(flags.threads));
  std::vector<Answer> answers(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Hit& hit = hits[i];
    if (!hit.is_return()) continue;
    const SurfelLabel label = map->notes().label(hit.surfel);
    const auto& names = map->notes().class_names();
    Answer& answer = answers[i];
    answer.range = hit.range;
    answer.cos_incidence = hit.cos_incidence;
    answer.thing = label.thing;
    if (label.kind < names.size()) answer.kind = names[label.kind];
    const double scale = map->reflectivity_per_intensity();
    if (scale > 0.0) answer.reflectivity = static_cast<float>(scale) * hit.intensity;
  }
  return answers;
}

std::string csv_of(const std::vector<Answer>& answers) {
  std::string text = "range,incidence_deg,reflectivity,class,thing\n";
  for (const Answer& answer : answers) {
    if (answer.range < 0.0f) {
      text += "inf,,,,\n";
      continue;
    }
    const double cosine = std::min(1.0, static_cast<double>(answer.cos_incidence));
    text +=
        fmt::format("{:.6g},{:.2f},{},{},{}\n",
                    answer.range,
                    math::acos(cosine) / kDegree,
                    answer.reflectivity < 0.0f ? "" : fmt::format("{:.3f}", answer.reflectivity),
                    answer.kind,
                    answer.kind.empty() ? "" : std::to_string(answer.thing));
  }
  return text;
}

void run_raycast(const RaycastFlags& flags) {
  if (!flags.output.empty()) check_outputs({flags.output}, {}, flags.force);
  const std::vector<Ray> rays = read_rays(flags);
  const std::string text =
      csv_of(flags.exact ? cast_exactly(flags, rays) : cast_into_map(flags, rays));
  if (flags.output.empty()) {
    fmt::print("{}", text);
    return;
  }
  OutputFile file(flags.output);
  file.write(std::as_bytes(std::span(text)));
  file.commit();
  fmt::print("{}\n", flags.output);
}

}  // namespace

void add_raycast_command(CLI::App& parent, int& /*exit_code*/) {
  auto* app = parent.add_subcommand("raycast", "What rays hit, in a map or in exact shapes");
  auto flags = std::make_shared<RaycastFlags>();
  app->add_option("place", flags->place, "MAP.pfmap, a world (street:7) or, with --exact, a scene")
      ->required();
  app->add_option(
         "rays", flags->rays, "Text, a ray a line: x y z dx dy dz, world, m; - : standard input")
      ->required();
  app->add_flag("--exact",
                flags->exact,
                "In the shapes that a world (or the map that `world make` made of it) is built of");
  app->add_option("--range-max", flags->range_max, "Rays end there, m")
      ->check(within(0.01, 1e6))
      ->capture_default_str();
  app->add_option("-o,--output", flags->output, "CSV to write (default: standard output)");
  app->add_option("--threads", flags->threads, "0: all")->check(CLI::NonNegativeNumber);
  add_force_flag(*app, flags->force);
  app->footer(
      "Columns: range (m; inf: nothing), incidence_deg (between ray and normal), reflectivity, "
      "class, thing.\n"
      "Example: echo 10 0 1.5 1 0.2 0 | pointflight raycast street:7 - --exact");
  app->callback([flags] { run_raycast(*flags); });
}

}  // namespace pointflight::apps
