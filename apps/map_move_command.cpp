#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <filesystem>
#include <utility>

#include "apps/cli.hpp"
#include "apps/flags.hpp"
#include "apps/map_edit.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/pose_files.hpp"

namespace pointflight::apps {
namespace {

// ---- transform ----

struct TransformFlags : EditFlags {
  std::string matrix;
  std::string pose;
  std::string origin;
  std::string up = "z";
  double scale = 1.0;
  bool level = false;
  bool ground_zero = false;
};

/// p_new = scale * rotation * p_old + translation.
struct Similarity {
  double scale = 1.0;
  Pose rigid;
  [[nodiscard]] Vector3d operator*(const Vector3d& p) const { return rigid * (scale * p); }
};

/// After what was there.
void then(Similarity& all, const Pose& next) {
  all.rigid = next * all.rigid;
}

std::string matrix_text(const std::string& flag) {
  std::error_code ignored;
  if (!std::filesystem::exists(flag, ignored)) return flag;
  const MappedFile file(flag);
  std::string text(as_text(file.bytes().first(std::min<std::size_t>(4096, file.bytes().size()))));
  for (char& c : text) c = c == '\n' || c == '\r' ? ' ' : c;
  return text;
}

/// A matrix of 4 x 4, row by row, that turns, shifts and scales alike along all axes.
Similarity similarity_of(const std::string& flag) {
  const std::vector<double> n =
      parse_numbers(matrix_text(flag), 16, "--matrix", "4 x 4, row by row, or a file of it");
  Matrix3d linear;
  linear << n[0], n[1], n[2], n[4], n[5], n[6], n[8], n[9], n[10];
  const double determinant = linear.determinant();
  if (!(determinant > 0.0)) {
    throw InputError("--matrix: its determinant is not positive: it mirrors or flattens the world");
  }
  Similarity result;
  result.scale = std::cbrt(determinant);
  const Matrix3d turn = linear / result.scale;
  const bool last_row = n[12] == 0.0 && n[13] == 0.0 && n[14] == 0.0 && n[15] == 1.0;
  if (!last_row || !(turn * turn.transpose()).isApprox(Matrix3d::Identity(), 1e-5)) {
    throw InputError(
        "--matrix: it shears or stretches; the upper 3 x 3 has to be a rotation times one scale, "
        "the last row 0 0 0 1");
  }
  if (std::abs(result.scale - 1.0) < 1e-6) result.scale = 1.0;
  result.rigid = {Quaterniond(turn).normalized(), {n[3], n[7], n[11]}};
  return result;
}

/// What the flags say without a look at the world.
Similarity stated(const TransformFlags& flags) {
  Similarity all;
  all.scale = flags.scale;
  if (flags.up == "y") {  // y up to z up: a quarter turn about x
    const double half = std::sqrt(0.5);
    then(all, {Quaterniond(half, half, 0.0, 0.0), Vector3d::Zero()});
  }
  if (!flags.matrix.empty()) {
    const Similarity given = similarity_of(flags.matrix);
    // scale * (R p + t) = R (scale p) + scale t
    all.rigid.translation *= given.scale;
    all.scale *= given.scale;
    then(all, given.rigid);
  }
  if (!flags.pose.empty()) then(all, parse_pose(flags.pose, "--pose"));
  return all;
}

/// What the floor says, and where the origin goes.
void complete(const TransformFlags& flags,
              const std::optional<FloorPlane>& floor,
              Similarity& all) {
  if (flags.level || flags.ground_zero) {
    if (!floor) {
      throw InputError(fmt::format(
          "{}: no floor is found: no flat surface within 30 degrees of level; give --matrix",
          flags.inputs.front()));
    }
    if (flags.level) then(all, floor->levelling());
    log(fmt::format("floor         tilted by {:.2f} degrees{}, at z = {} m{}",
                    floor->tilt / kDegree,
                    flags.level ? " and made level" : "",
                    fixed_text(floor->middle_world.z(), 2),
                    flags.ground_zero ? ", now 0" : ""));
    if (flags.ground_zero) {
      then(all, {Quaterniond::Identity(), {0.0, 0.0, -floor->middle_world.z()}});
    }
  }
  if (flags.origin.empty()) return;
  const std::vector<double> n = parse_numbers(flags.origin, 3, "--origin", "x,y,z in metres");
  then(all, {Quaterniond::Identity(), {-n[0], -n[1], -n[2]}});
}

/// A cloud as it lies after a transform.
class TransformedReader : public CloudReader {
 public:
  TransformedReader(std::unique_ptr<CloudReader> reader, const Similarity& transform)
      : reader_(std::move(reader)), transform_(transform) {}
  bool read(std::vector<CloudPoint>& batch) override {
    const bool more = reader_->read(batch);
    for (CloudPoint& point : batch) point.position = transform_ * point.position;
    return more;
  }
  [[nodiscard]] bool has_intensity() const override { return reader_->has_intensity(); }
  [[nodiscard]] bool has_color() const override { return reader_->has_color(); }
  [[nodiscard]] double share_read() const override { return reader_->share_read(); }

 private:
  std::unique_ptr<CloudReader> reader_;
  Similarity transform_;
};

/// The floor of a cloud is that of the map that it makes.
std::optional<FloorPlane> floor_of(const TransformFlags& flags,
                                   const CloudSource& source,
                                   const Similarity& transform,
                                   const Progress& progress) {
  ImportOptions options;
  options.quality = TreeQuality::kNormal;
  options.scratch_folder = scratch_of(flags);
  const auto opener = [&](std::size_t) {
    return std::make_unique<TransformedReader>(source.open({}, progress), transform);
  };
  return build_map({source.name()}, opener, options, Executor(flags.threads), progress)
      .report.floor;
}

void transform_cloud(const TransformFlags& flags) {
  const Progress progress = interruptible_progress();
  Similarity all = stated(flags);
  const CloudSource source = only_cloud(flags, progress);
  std::optional<FloorPlane> floor;
  if (flags.level || flags.ground_zero) floor = floor_of(flags, source, all, progress);
  complete(flags, floor, all);
  CloudOutput output(flags, columns_of_edit(source, progress));
  std::uint64_t points = 0;
  const std::uint64_t not_finite =
      stream_points(source, points, "moving", progress, [&](std::vector<CloudPoint>& batch) {
        for (CloudPoint& point : batch) point.position = all * point.position;
        output.write(std::span<const CloudPoint>(batch));
      });
  output.finish(points, not_finite, "moved");
}

void transform_surfels(const TransformFlags& flags) {
  Similarity all = stated(flags);
  if (all.scale != 1.0) {
    throw InputError(fmt::format("{}: a map cannot be scaled; import its cloud with --scale {:.7g}",
                                 flags.inputs.front(),
                                 all.scale));
  }
  OutputFile output(flags.output);
  const auto map = open_sound_map(flags.inputs.front());
  std::optional<FloorPlane> floor;
  if (flags.level || flags.ground_zero) floor = find_floor(*map, all.rigid);
  complete(flags, floor, all);
  const Quaterniond& q = all.rigid.rotation;
  const Vector3d& t = all.rigid.translation;
  const std::string note =
      fmt::format("transform: rotation {} {} {} {} (w x y z), shift {} {} {} m",
                  q.w(),
                  q.x(),
                  q.y(),
                  q.z(),
                  t.x(),
                  t.y(),
                  t.z());
  const Executor executor(flags.threads);
  const EditedMap edited = transform_map(*map, all.rigid, edit_options(flags, note), executor);
  finish_map(flags, std::move(output), edited);
}

void transform(const TransformFlags& flags) {
  const bool does_something = !flags.matrix.empty() || !flags.pose.empty() ||
                              !flags.origin.empty() || flags.level || flags.ground_zero ||
                              flags.scale != 1.0 || flags.up != "z";
  if (!does_something) {
    throw InputError(
        "nothing says how to move; give --matrix, --pose, --level, --ground-zero, --origin, "
        "--scale or --up");
  }
  if (check_edit(flags)) {
    transform_surfels(flags);
  } else {
    transform_cloud(flags);
  }
}

// ---- merge ----

struct MergeFlags : EditFlags {
  std::vector<std::string> poses;
  std::string poses_file;
};

/// One for each input.
std::vector<Pose> poses_of(const MergeFlags& flags) {
  std::vector<Pose> poses;
  if (!flags.poses_file.empty()) {
    if (!flags.poses.empty()) throw InputError("give --pose or --poses, not both");
    for (const TumPose& pose : read_tum(flags.poses_file)) poses.push_back(pose.T_world_sensor);
  } else if (flags.poses.empty()) {
    poses.resize(flags.inputs.size());
  } else {
    for (const std::string& pose : flags.poses) poses.push_back(parse_pose(pose, "--pose"));
  }
  if (poses.size() == flags.inputs.size()) return poses;
  throw InputError(fmt::format("{} poses for {} inputs; give one for each, in their order",
                               poses.size(),
                               flags.inputs.size()));
}

void merge_clouds(const MergeFlags& flags, const std::vector<Pose>& poses) {
  const Progress progress = interruptible_progress();
  const auto sources = cloud_sources(flags.inputs, flags.format, scratch_of(flags), progress);
  // what all of them have; else some points would have made-up values
  CloudColumns columns{.intensity = true, .color = true};
  for (const CloudSource& source : sources) {
    const CloudColumns own = columns_of_edit(source, progress);
    columns.intensity = columns.intensity && own.intensity;
    columns.color = columns.color && own.color;
  }
  CloudOutput output(flags, columns);
  std::uint64_t points = 0;
  std::uint64_t not_finite = 0;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    not_finite +=
        stream_points(sources[i], points, "merging", progress, [&](std::vector<CloudPoint>& batch) {
          for (CloudPoint& point : batch) point.position = poses[i] * point.position;
          output.write(std::span<const CloudPoint>(batch));
        });
  }
  output.finish(points, not_finite, "merged");
}

void merge(const MergeFlags& flags) {
  const std::vector<Pose> poses = poses_of(flags);
  if (!check_edit(flags)) {
    merge_clouds(flags, poses);
    return;
  }
  OutputFile output(flags.output);
  std::vector<PlacedMap> maps;
  for (std::size_t i = 0; i < flags.inputs.size(); ++i) {
    maps.push_back({open_sound_map(flags.inputs[i]), poses[i]});
  }
  std::vector<std::string> names;
  for (const std::string& input : flags.inputs) {
    names.push_back(std::filesystem::path(input).filename().string());
  }
  const Executor executor(flags.threads);
  const EditedMap edited =
      merge_maps(maps,
                 edit_options(flags, fmt::format("merge {}", fmt::join(names, " "))),
                 executor,
                 interruptible_progress());
  finish_map(flags, std::move(output), edited);
}

}  // namespace

void add_transform(CLI::App& parent) {
  auto* app = parent.add_subcommand("transform", "Move, turn or level a map or cloud");
  auto flags = std::make_shared<TransformFlags>();
  add_input(*app, *flags);
  add_edit_flags(
      *app, *flags, "What to write: a .pfmap of a .pfmap; .pcd, .ply, .las of clouds", true);
  app->add_option("--scale", flags->scale, "Metres per unit of the cloud")
      ->check(within(1e-9, 1e9))
      ->capture_default_str();
  app->add_option("--up", flags->up, "The up axis; y is turned to z")
      ->check(CLI::IsMember({"y", "z"}))
      ->capture_default_str();
  app->add_option("--matrix",
                  flags->matrix,
                  "4 x 4, row by row: 16 numbers, or a file that holds them (CloudCompare's form)");
  app->add_option(
      "--pose", flags->pose, "x,y,z[,roll,pitch,yaw] of the old origin: metres, degrees");
  app->add_flag("--level", flags->level, "Turn the largest floor level about its middle");
  app->add_flag("--ground-zero", flags->ground_zero, "Put that floor at z = 0");
  app->add_option("--origin", flags->origin, "x,y,z that becomes 0,0,0, m");
  app->footer(
      "Done in the order of this list. A map that is only shifted keeps every bit; a turn rounds "
      "its surfels anew.\n"
      "  pointflight map transform slam.pfmap -o level.pfmap --level --ground-zero");
  app->callback([flags] { transform(*flags); });
}

void add_merge(CLI::App& parent) {
  auto* app = parent.add_subcommand("merge", "Join maps of one resolution, or clouds");
  auto flags = std::make_shared<MergeFlags>();
  app->add_option("inputs", flags->inputs, "Two or more .pfmap, or clouds")->required();
  add_edit_flags(
      *app, *flags, "What to write: a .pfmap of .pfmap; .pcd, .ply, .las of clouds", true);
  app->add_option(
         "--pose",
         flags->poses,
         "x,y,z[,roll,pitch,yaw] of an input in the result: metres, degrees; once for each, "
         "in their order")
      ->allow_extra_args(false);
  app->add_option("--poses", flags->poses_file, "The same as a TUM file: a line for each input");
  app->footer(
      "Where an earlier map has a surfel in the same place, that of a later one is left out.\n"
      "  pointflight map merge a.pfmap b.pfmap -o both.pfmap --pose 0,0,0,0,0,0 --pose "
      "12,3,0,0,0,90");
  app->callback([flags] { merge(*flags); });
}

}  // namespace pointflight::apps
