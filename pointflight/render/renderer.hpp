#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pointflight/core/cpu_account.hpp"
#include "pointflight/core/parallel.hpp"
#include "pointflight/core/registry.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/map/body.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/render/hit.hpp"
#include "pointflight/render/sensor_beams.hpp"
#include "pointflight/render/wide_beams.hpp"

namespace pointflight {

/// The static scene: the map. Moving bodies come with each batch of rays.
struct Scene {
  std::shared_ptr<const SurfelMap> map;  ///< Never null.
};

/// Where the draws of a scan's beams are in a run's random streams.
struct BeamDraws {
  std::uint64_t seed = 0;    ///< The run's.
  std::uint32_t entity = 0;  ///< Vehicle << 8 | sensor, below 2^28.
  std::uint64_t scan = 0;    ///< Its number, below 2^32.
};

/// The rays of one scan and what a renderer that makes images needs to lay them out.
struct RayBatch {
  std::span<const Ray> rays;  ///< World; those of a snapshot may differ in origin.
  /// Or, if it is not null, the beams that rays are to be made of, by whoever traces them.
  const AimedBeams* aimed = nullptr;
  /// The rays' `direction_order`, or empty: the renderer finds it if it needs one. For patterns
  /// that repeat.
  std::span<const std::uint32_t> order;
  /// Where the sensor is and how it is turned: middle of the scan for a moving one. Renderers that
  /// trace single rays ignore it.
  Pose T_world_sensor;
  float range_max = 100.0f;                               ///< Longest range of any ray, m.
  double image_resolution = 0.2 * 0.0174532925199432958;  ///< theta_res of image renderers, rad.

  /// Obstacles and other vehicles; each ray sees them where they are at its own time.
  std::span<const Body> bodies;
  SimTime time;                            ///< What `time_offsets` count from.
  std::span<const Duration> time_offsets;  ///< Of each ray, or empty: all at `time`.
  SimTime snapshot_time;                   ///< Of `T_world_sensor`: for renderers of images.

  /// By which beams come back from what lets some through (`Opacity`).
  BeamDraws draws;

  /// When a ray leaves: its bodies are where they are then.
  [[nodiscard]] SimTime time_of(std::size_t ray) const {
    return time_offsets.empty() ? time : time + time_offsets[ray];
  }
  /// How many rays it has.
  [[nodiscard]] std::size_t size() const {
    return aimed != nullptr ? aimed->beams->beams.size() : rays.size();
  }
};

/// What a renderer is asked for. What it refers to must stay as it is until the hits are there.
struct RenderJob {
  RayBatch batch;       ///< Of one scan.
  std::span<Hit> hits;  ///< Of each ray, written; none of wide beams, or if `ranges` are asked for.
  /// The beams' cross-sections, if they have any: then rays are their axes, and what is written are
  /// `WideBeams::echoes`, no hits.
  std::optional<WideBeams> wide;
  CpuAccount* account = nullptr;  ///< Is charged with what the job costs; null: whoever asks.
  /// Instead of hits, for who wants no more: `Hit::range` of each ray, written.
  std::span<float> ranges{};
};

/// Jobs that a renderer has been given (`Renderer::submit`).
class Rendering {
 public:
  virtual ~Rendering() = default;
  /// Waits until all hits are written. Once. Throws what went wrong.
  virtual void collect() = 0;
};

/// Turns rays into hits. Results do not depend on the executor's threads.
///
/// To add one: derive, write its file in render/, add one row to the table in renderer.cpp and a
/// test that compares it with `beam` on the scenes of tests/render. Programs add rows of their own:
/// `RendererKind::table().add(...)`. One that runs on another device overrides `submit`.
class Renderer {
 public:
  virtual ~Renderer() = default;

  /// Writes the hits of all jobs. Rays are finite, which debug builds assert; throws
  /// std::invalid_argument if sizes do not fit, a pose is not finite or a body lacks its shape.
  void render(std::span<const RenderJob> jobs, const Executor& executor) const;
  /// The same of one scan's rays, each a beam; `hits` has their length.
  void render(const RayBatch& batch, std::span<Hit> hits, const Executor& executor) const;

  /// The same for callers that have other things to do meanwhile. All that the jobs refer to, the
  /// renderer and the executor must outlive the rendering. Here: everything is rendered at once.
  [[nodiscard]] virtual std::unique_ptr<Rendering> submit(std::span<const RenderJob> jobs,
                                                          const Executor& executor) const;

  /// One ray against the map by itself.
  [[nodiscard]] virtual Hit trace(const Ray& ray) const;

  /// True if all rays are rendered from `T_world_sensor` whatever their own origins are.
  [[nodiscard]] virtual bool is_snapshot() const { return false; }

  /// How many scans it would rather have together, while as many others are being finished; 0: as
  /// many as there are threads, and nothing meanwhile.
  [[nodiscard]] virtual std::size_t jobs_at_once() const { return 0; }

 protected:
  /// True if `render_one` and `render_wide` make rays of aimed beams and write ranges; else they
  /// are given rays and hits.
  [[nodiscard]] virtual bool makes_rays() const { return false; }
  /// One job of beams that are lines, which is valid.
  virtual void render_one(const RenderJob& job, const Executor& executor) const = 0;
  /// One job of wide beams, which is valid. Here: by rays over each, 32 unless it says how many.
  virtual void render_wide(const RenderJob& job, const Executor& executor) const;
};

/// A row of the table of renderers.
struct RendererKind {
  static constexpr const char* kWhat = "renderer";  ///< In messages.
  /// "beam", the first, and "paper"; programs may add their own before scenarios are read.
  static Registry<RendererKind>& table();

  std::string name;  ///< In scenarios and flags.
  std::string help;  ///< Half a sentence.
  /// Of a scene. May throw InputError.
  std::function<std::unique_ptr<Renderer>(const Scene& scene)> make;
  bool one_pose = false;  ///< All rays of a scan leave from one pose: `Renderer::is_snapshot`.
};

/// Makes a renderer of a kind for a scene. If the map has surfels that let beams through
/// (`SurfelNotes::has_opacity`), its beams go on behind them. Throws InputError, and
/// std::invalid_argument if the scene has no map.
std::unique_ptr<Renderer> make_renderer(const RendererKind& kind, const Scene& scene);

/// The same by name ("beam", "paper"). Throws InputError that lists the names.
std::unique_ptr<Renderer> make_renderer(const std::string& name, const Scene& scene);

}  // namespace pointflight
