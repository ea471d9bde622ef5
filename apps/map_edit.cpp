#include "apps/map_edit.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <utility>

#include "apps/cli.hpp"
#include "apps/flags.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/io/byte_cursor.hpp"

namespace pointflight::apps {
namespace {

void sample_map(const Bvh8& tree, const MapDescription& description, picture::PointSample& sample) {
  const auto words = tree.words.span();
  for_each_surfel(
      std::span<const SurfelWord>(words), [&](const LeafHeader& leaf, std::size_t word) {
        const Vector3d place =
            Vector3d(leaf.x, leaf.y, leaf.z) + decode(words[word]).center_voxels.cast<double>();
        sample.add(description.origin_world + description.resolution * place);
      });
}

std::string extent_of(const Aabb& b) {
  return fmt::format("{:.2f} x {:.2f} x {:.2f} m", b.size().x(), b.size().y(), b.size().z());
}

}  // namespace

void add_edit_flags(CLI::App& app,
                    EditFlags& flags,
                    const std::string& what,
                    bool output_required) {
  auto* output = app.add_option("-o,--output", flags.output, what);
  if (output_required) output->required();
  app.add_option("--png", flags.png, "Draw a top and a side view of the result");
  app.add_option("--format",
                 flags.format,
                 "What input clouds are, whatever their names: pcd, ply, las, xyz, ...");
  app.add_option("--scratch",
                 flags.scratch,
                 "Folder for what does not fit in memory; without it that of the output")
      ->check(CLI::ExistingDirectory);
  app.add_option("--threads", flags.threads, "0: all cores")->check(CLI::Range(0, 1024));
  add_force_flag(app, flags.force);
}

bool is_map(const std::string& path) {
  return path.ends_with(".pfmap");
}

bool check_edit(const EditFlags& flags, const OtherFiles& more) {
  const bool makes_map = is_map(flags.output);
  for (const std::string& input : flags.inputs) {
    if (is_map(input) == makes_map) continue;
    throw InputError(
        makes_map
            ? fmt::format("{}: is a cloud and {} a map; make a map of a cloud by: pointflight "
                          "map import",
                          input,
                          flags.output)
            : fmt::format("{}: is a map and {} a cloud; make a cloud of a map by: pointflight "
                          "map export",
                          input,
                          flags.output));
  }
  if (!makes_map) require_writable_cloud(flags.output);
  std::vector<std::string> outputs = {flags.output, flags.png};
  outputs.insert(outputs.end(), more.outputs.begin(), more.outputs.end());
  std::vector<std::string> inputs = flags.inputs;
  inputs.insert(inputs.end(), more.inputs.begin(), more.inputs.end());
  check_outputs(outputs, inputs, flags.force);
  return makes_map;
}

std::string scratch_of(const EditFlags& flags) {
  if (!flags.scratch.empty()) return flags.scratch;
  if (flags.output.empty()) return {};
  const std::filesystem::path folder = std::filesystem::path(flags.output).parent_path();
  return folder.empty() ? "." : folder.string();
}

EditOptions edit_options(const EditFlags& flags, const std::string& note) {
  EditOptions options;
  options.scratch_folder = scratch_of(flags);
  options.note = note;
  return options;
}

std::shared_ptr<const SurfelMap> open_sound_map(const std::string& path) {
  auto map = SurfelMap::open(path);
  map->verify();
  return map;
}

void finish_map(const EditFlags& flags, OutputFile output, const EditedMap& edited) {
  end_progress();
  OutputSet outputs;
  write_map(std::move(output), edited.tree, edited.description);
  log(fmt::format(
      "surfels       {} of {}{}",
      edited.surfels,
      edited.surfels_before,
      edited.doubles > 0
          ? fmt::format("; {} left out where an earlier map has the place", edited.doubles)
          : ""));
  const Aabb& b = edited.description.bounds_world;
  log(fmt::format("extent        {}, from {}", extent_of(b), point_text(b.min)));
  if (!flags.png.empty()) {
    picture::PointSample sample;
    sample_map(edited.tree, edited.description, sample);
    picture::draw_points(flags.output,
                         fmt::format("{} surfels at {:.4g} m, {}",
                                     edited.surfels,
                                     edited.description.resolution,
                                     extent_of(b)),
                         {{"", picture::kInk, true, &sample}},
                         flags.png);
    log("picture: " + flags.png);
  }
  outputs.commit();
  fmt::print("{}\n", flags.output);
}

CloudOutput::CloudOutput(const EditFlags& flags, const CloudColumns& columns)
    : flags_(flags), writer_(write_cloud(OutputFile(flags.output), columns)) {}

void CloudOutput::write(std::span<const CloudPoint> points, std::span<const std::byte> raw) {
  writer_->write(points, raw);
  for (const CloudPoint& point : points) {
    if (point.position.allFinite()) sample_.add(point.position);
  }
}

void CloudOutput::write(std::span<const CloudRow> rows) {
  writer_->write(rows);
  for (const CloudRow& row : rows) sample_.add(row.point.position);
}

void CloudOutput::finish(std::uint64_t points_read,
                         std::uint64_t not_finite,
                         const std::string& title) {
  end_progress();
  if (writer_->count() == 0) {
    throw InputError(fmt::format("{}: no point is left; nothing is written", flags_.output));
  }
  OutputSet outputs;
  writer_->commit();
  log(fmt::format("{:14}{} points of {}{}",
                  title,
                  writer_->count(),
                  points_read,
                  not_finite > 0 ? fmt::format("; {} NaN or infinite dropped", not_finite) : ""));
  if (const std::string loss = writer_->loss(); !loss.empty()) {
    log(fmt::format("warning: {}: {}", flags_.output, loss));
  }
  if (!flags_.png.empty()) {
    picture::draw_points(flags_.output,
                         fmt::format("{} points", writer_->count()),
                         {{"", picture::kInk, true, &sample_}},
                         flags_.png);
    log("picture: " + flags_.png);
  }
  outputs.commit();
  fmt::print("{}\n", flags_.output);
}

CloudColumns columns_of(const CloudReader& reader) {
  CloudColumns columns;
  columns.intensity = reader.has_intensity();
  columns.color = reader.has_color();
  return columns;
}

CloudColumns columns_of_edit(const CloudSource& source, const Progress& progress) {
  const auto reader = source.open({}, progress);
  std::vector<std::string> names;
  for (const RawColumn& column : reader->raw_columns()) names.push_back(excerpt(column.name));
  if (!names.empty()) {
    log(fmt::format("left out      {} of {} (map export keeps columns)",
                    fmt::join(names, ", "),
                    source.name()));
  }
  return columns_of(*reader);
}

std::uint64_t stream_points(const CloudSource& source,
                            std::uint64_t& points_read,
                            const std::string& what,
                            const Progress& progress,
                            const std::function<void(std::vector<CloudPoint>&)>& visit) {
  const auto reader = source.open({}, progress);
  std::uint64_t not_finite = 0;
  std::vector<CloudPoint> batch;
  while (reader->read(batch)) {
    points_read += batch.size();
    not_finite +=
        std::erase_if(batch, [](const CloudPoint& point) { return !point.position.allFinite(); });
    visit(batch);
    report(progress, what, reader->share_read());
  }
  return not_finite;
}

CloudSource only_cloud(const EditFlags& flags, const Progress& progress) {
  return cloud_sources(flags.inputs, flags.format, scratch_of(flags), progress).front();
}

void add_input(CLI::App& app, EditFlags& flags) {
  app.add_option(
         "input", flags.inputs, "A .pfmap, or a cloud or mesh; -: a cloud from standard input")
      ->required()
      ->expected(1);
}

}  // namespace pointflight::apps
