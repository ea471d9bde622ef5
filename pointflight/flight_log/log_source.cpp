#include "pointflight/flight_log/log_source.hpp"

namespace pointflight {

std::optional<SourcedState> LogSource::state_at(SimTime time) {
  SourcedState state;
  state.body = log_.state_at(from_ + to_seconds(time));
  state.body.p_world = T_map_log_.rotation * state.body.p_world + T_map_log_.translation;
  state.body.v_world = T_map_log_.rotation * state.body.v_world;
  state.body.q_world_body = (T_map_log_.rotation * state.body.q_world_body).normalized();
  return state;
}

}  // namespace pointflight
