#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "apps/cli.hpp"
#include "pointflight/io/cloud_writer.hpp"
#include "pointflight/map/edit/map_edit.hpp"
#include "pointflight/map/import/map_points.hpp"
#include "pointflight/picture/point_picture.hpp"

/// What `map crop`, `thin`, `transform`, `merge`, `export` and `diff` share.
namespace pointflight::apps {

struct EditFlags {
  std::vector<std::string> inputs;
  std::string output;
  std::string png;
  std::string format;
  std::string scratch;
  bool force = false;
  int threads = 0;
};

/// --format, --png, --scratch, --threads, --force; -o with `what` it writes.
void add_edit_flags(CLI::App& app, EditFlags& flags, const std::string& what, bool output_required);

/// The one input of a command.
void add_input(CLI::App& app, EditFlags& flags);

/// The one cloud of a command line.
CloudSource only_cloud(const EditFlags& flags, const Progress& progress);

bool is_map(const std::string& path);

/// Files of a command beside those of its EditFlags.
struct OtherFiles {
  std::vector<std::string> outputs;
  std::vector<std::string> inputs;
};

/// Refuses outputs that are there or are inputs (`check_outputs`), and kinds that do not go
/// together: a .pfmap makes a .pfmap, clouds make a cloud. Returns true for .pfmap.
bool check_edit(const EditFlags& flags, const OtherFiles& more = {});

/// The folder for what does not fit into memory.
std::string scratch_of(const EditFlags& flags);

EditOptions edit_options(const EditFlags& flags, const std::string& note);

/// The whole file is read: an edit must not make a sound map of a damaged one.
std::shared_ptr<const SurfelMap> open_sound_map(const std::string& path);

/// Writes an edited map, says what became of it, and draws it if --png asks.
void finish_map(const EditFlags& flags, OutputFile output, const EditedMap& edited);

/// A cloud on its way out: counted, sampled for the picture.
class CloudOutput {
 public:
  CloudOutput(const EditFlags& flags, const CloudColumns& columns);

  void write(std::span<const CloudPoint> points, std::span<const std::byte> raw = {});
  void write(std::span<const CloudRow> rows);

  /// Completes the file, says what became of `points_read`, and draws it if --png asks. Throws
  /// InputError if no point is left.
  void finish(std::uint64_t points_read, std::uint64_t not_finite, const std::string& title);

 private:
  const EditFlags& flags_;
  std::unique_ptr<CloudWriter> writer_;
  picture::PointSample sample_;
};

/// Columns of what a reader gives, as points.
CloudColumns columns_of(const CloudReader& reader);
/// The same for an edit, which writes nothing else: says what is left out.
CloudColumns columns_of_edit(const CloudSource& source, const Progress& progress);

/// Calls `visit` with the finite points of a cloud, batch by batch; it may change them. Returns how
/// many were not finite, and adds all to `points_read`.
std::uint64_t stream_points(const CloudSource& source,
                            std::uint64_t& points_read,
                            const std::string& what,
                            const Progress& progress,
                            const std::function<void(std::vector<CloudPoint>&)>& visit);

void add_import(CLI::App& parent);
void add_crop(CLI::App& parent);
void add_thin(CLI::App& parent);
void add_transform(CLI::App& parent);
void add_merge(CLI::App& parent);
void add_export(CLI::App& parent);
void add_diff(CLI::App& parent);
void add_fit(CLI::App& parent);

}  // namespace pointflight::apps
