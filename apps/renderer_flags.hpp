#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <utility>

#include "apps/flight_part.hpp"

namespace pointflight::apps {

/// What renders.
struct RendererFlags {
  std::string renderer;  ///< A row of the table of renderers; empty: as the scenario says.
  std::string gpu;       ///< Index or part of a name; empty: the first.
};

/// Adds `--renderer` and `--gpu`; `help` of the former.
void add_renderer_flags(CLI::App& app, RendererFlags& flags, const std::string& help);
/// Before a renderer is made: on which GPU. Throws InputError if there is none of this name, or
/// none renders.
void choose_renderer(const RendererFlags& flags);
/// What went wrong with GPUs, to the user.
void say_gpu_notices();

/// The flags' renderer for all LiDARs of a flight.
class RendererPart : public FlightPart {
 public:
  explicit RendererPart(RendererFlags flags) : flags_(std::move(flags)) {}

  void prepare(Scenario& scenario, double rate) override;
  void report(const RunLoop& loop) const override;

 private:
  RendererFlags flags_;
};

}  // namespace pointflight::apps
